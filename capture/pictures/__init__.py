"""What comes in: clips, mattes and shots; and the proof pictures that show what was captured.

Read `clip`, `decode` and `encode` (files), `colors`, `seeds`, `patches` and `matte` (which pixels belong), `held`
(which drawings are held), `shot` (what to capture), `overlay`.
"""
