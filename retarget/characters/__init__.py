"""Who plays the motion: read `target`, the one protocol, and `places`, where a character stands, first.

Then a room for each kind: `drawings`, `photos`, `models`, `figures` with joints, and `bodies` that play several parts
at once.  `proposed` makes keys for who has none; `casts`, who plays what, comes last.
"""
