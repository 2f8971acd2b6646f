"""The performance, from motion to pictures.

Read `perform` (motion meets target) with `together` (one body, several parts), `staging` with `offsets`, `legs` and
`direct` (feet stay where they stand, or where a cast says), `footing` and `play` (changed cartoons, motion capture)
with `held` (a drawing that is posed), `draw2d` with `warp`, `lay` and `zbuffer` (pictures), `page` and `folds` (what is
to be told of them) and `keysheet`; then what is behind: `composite` (before footage) and `plate` with `carry` and
`camera` (back into the clip).
"""
