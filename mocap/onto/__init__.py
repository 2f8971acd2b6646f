"""Motion capture onto drawings.

Read `marks`, `bones`, which says who plays what, `views`, `hung`, `travel` and `to_tracks`; `dragged` is for a drawing
whose own joints are moved; `by_poses` is another way, for any cast that has key drawings.
"""
