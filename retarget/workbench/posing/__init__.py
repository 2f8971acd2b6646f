"""The posing desk: joints dragged on springs, postures on beats, a clip made of rubber.

Read `puppet` (a drawing) and `fleshed` (a model), `posed`, `phrases`, `music`, `files`, then the `desk`.
"""
