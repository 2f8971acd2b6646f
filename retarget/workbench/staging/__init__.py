"""The stage desk: who plays a captured motion, how they stand, and what is exported.

Read `playing`, `casts` and `offers`; `staged` (what all of it looks up); keys by hand in `redraw`, `limbs`,
`thumbs`, `keys`; models seen from elsewhere in `solids`, `orbit`, `space`; then the `desk`.
"""
