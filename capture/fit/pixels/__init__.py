"""A part in pictures (Bregler et al. 2002, section 3.3): what is compared, and how it is laid over a frame.

Read `layer` (what is compared), `track_affine` (eqs. 8-13), `keyimages` (pictures of the in-betweens), `track_keys`
(eqs. 14-16), `track_shape` (the fine fit), `model` (what is learnt of a part) and `find` (a part in one picture).
"""
