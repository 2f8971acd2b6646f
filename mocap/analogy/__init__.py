"""What was done to one motion, done to another (Wu et al. 2008).

Read `curves` (motions as channels), `match` and `lend` (whose joint is whose, and one's motion on another's skeleton),
`align`, `cycles`, `cover`, `transfer` and `rhythm`, `analogy`, which joins them, `carry` and `feet` (that stand), and
`cartoons` (captured motions).  `styles` makes examples by formula, `experiments` are the paper's four.
"""
