"""One demo for each of the paper's examples, from a drawn clip to a new one.

Read `shown` (what a demo hands back and leaves), then `frog_to_bunny`, `drawings`, `photographs` and `bodies`, and
`table`, which names them all.
"""
