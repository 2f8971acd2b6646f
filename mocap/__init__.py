"""Motion capture made cartoon-like.

Read the rooms in this order: `skeletons`, joints over time and their files; `bodies`, which joint is what; `curves`,
what may be done to any of them; `rubber`, exaggeration; `analogy`, the style of others; `posing`, springs between
postures; `onto`, all of it onto drawings.  `report` measures what came out, `sticks` draws it.
"""
