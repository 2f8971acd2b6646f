"""The captures: from pictures to affine maps and key weights (Bregler et al. 2002, sections 3.1.3-3.3).

Read `layer` (what is compared), `track_affine` (eqs. 8-13), `keyspace` and `keyimages` (in-betweens and PCA),
`track_keys` (eqs. 14-16), `track_shape` (the fine fit), `weights` and `contour` (key weights), `model` (what is
learnt of a part), `find` (a part in one picture) and, last, `video`, which runs a whole shot.
"""
