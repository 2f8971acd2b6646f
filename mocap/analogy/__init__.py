"""What was done to one motion, done to another (Wu et al. 2008).

Read `curves` (motions as channels), `match` (whose joint is whose), `align`, `cycles`, `transfer` and `rhythm`, and
`analogy`, which joins them.
"""
