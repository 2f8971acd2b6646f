"""The space of shapes between the keys, and weights in it (Bregler et al. 2002, sections 3.1.3 and 3.2).

Read `keyspace` (PCA of the in-betweens), `weights` (what a caller sees), `sparse_weights` (at most J rows, exactly),
`smooth_weights` (the whole clip at once) and `convex_start` (weights before any map is known); `fields` is
for what lies outside that space.
"""
