"""Motion capture onto drawings.

Read `marks`, `bones`, which says who plays what, `views`, `hung`, `travel` and `to_tracks`; `by_poses` is another way,
for any cast that has key drawings.
"""
