"""What was done to one motion, done to another (Wu et al. 2008).

Read `curves` (motions as channels), `match` (whose joint is whose), `align`, `cycles`, `transfer` and `rhythm`,
`analogy`, which joins them, `feet` (that stand) and `cartoons` (captured motions).
"""
