"""The captures: from pictures or contours to affine maps and key weights (Bregler et al. 2002, sections 3.1-3.3).

Read `video` (a whole shot), `contour` (points known in every frame), `contour_parts` (a drawing in parts), `action`
(a line of action), `suggest` with `outlines` (which drawings are the keys), and `batch` (many shots).  What they stand
on is in `pixels`, `shapes` and `curves`.
"""
