"""The capture desk: tell the parts of a clip, find their keys, capture, and mend what is off.

Read `parts` and `moving`, `work` (what takes long), then the `desk`.
"""
