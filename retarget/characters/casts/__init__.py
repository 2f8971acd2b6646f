"""Who plays what.

Read `castfile` (what a cast says) with `castcheck`, `cast` (it becomes targets) and `backdrop`.
"""
