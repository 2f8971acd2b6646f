"""Drawings as characters.

Read `paths` (what is drawn), `svgfile` and `svg` (where from), `embed` and `limbs` (the mesh round it), `drawing`,
`bend` (along a line of action) and `svgout`.
"""
