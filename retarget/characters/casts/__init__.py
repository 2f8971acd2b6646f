"""Who plays what.

Read `castlist` (its records), `castfile` (what it says) with `castcheck`, `cast` (it becomes targets) and
`backdrop`.
"""
