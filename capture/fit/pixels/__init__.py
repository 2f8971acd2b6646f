"""A part in pictures (Bregler et al. 2002, section 3.3): what is compared, and how it is laid over a frame.

Read `layer` (what is compared), `trust` and `kernels` (how much pixels count, and quick sums), `track_affine` (eqs.
8-13), `keyimages` (pictures of the in-betweens), `track_keys` (eqs. 14-16), `track_shape` (the fine fit), `outside`
(drawings that no mix of keys explains) and `model` (what is learnt of a part). Then all parts in one picture:
`sighting` (what is known of a part on the way), `cover` (whose pixels are whose), `descend` (one fit and its
evidence), `aside` (what is drawn otherwise than in the keys), `belief` (seen, doubtful or lost), `search` (other
starts), `held`, `expect` (parents carry their children) and `find`.
"""
