"""The language of cartoon motion: affine maps, key shapes, in-betweens and tracks.

Read `affine`, `triangulate`, `arap`, `keys` and, last, `tracks`: one equation carries everything.
"""
