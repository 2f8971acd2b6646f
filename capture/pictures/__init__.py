"""What comes in: clips, mattes and shots; and the proof pictures that show what was captured.

Read `clip`, `decode` and `encode` (files), `matte` (which pixels belong), `shot` (what to capture), `overlay`.
"""
