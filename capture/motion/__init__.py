"""The language of cartoon motion: affine maps, key shapes, in-betweens and tracks.

Read `affine`, `triangulate`, `arap`, `keys` and `tracks`: one equation carries everything.  `parts` are parts of parts,
`gaps` what goes on where a part is hidden.
"""
