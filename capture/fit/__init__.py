"""The captures: from pictures to affine maps and key weights (Bregler et al. 2002, sections 3.1.3-3.3).

Read `layer` (what is compared), `track_affine` (eqs. 8-13), `keyspace` (in-betweens and PCA),
`track_keys` (eqs. 14-16), `weights` (key weights by QP) and, last, `video`, which runs a whole shot.
"""
