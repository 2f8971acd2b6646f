"""The captures: from pictures or contours to affine maps and key weights (Bregler et al. 2002, sections 3.1-3.3).

Read `video` (a whole shot) with `passes`, `meet`, `poses` and `checkpoint` (its way through the clip), `again` with
`source` (only what was changed), `refine` (the same once more, all frames together), `contour` (points known in every
frame), `contour_parts` (a drawing in parts), `action` (a line of action), `suggest` with `outlines` (which drawings are
the keys), and `batch` (many shots).  What they stand on is in `pixels`, `shapes`, `curves` and `whole`.
"""
