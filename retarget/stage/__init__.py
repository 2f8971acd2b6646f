"""The performance, from motion to pictures.

Read `perform` (motion meets target), `staging` with `offsets` (feet stay where they stand), `draw2d` with `warp`,
`lay` and `zbuffer` (pictures of drawings, photographs and models); then what is behind: `composite` (before
footage) and `plate` with `carry` and `camera` (back into the clip that the motion came from).
"""
