"""Posing and dancing (Chen et al. 2004).

Read `poses` and `springs` with its `ties`, `stars`, `sweeps`, `twists`, `limits` and `machine` (a joint is
dragged), `session` and `playing`; `postures`, `starting`, `rest`, `standing` (poses with names); `elastic`, `modes`
and `wind` (what moves between them); `sounds`, `beats`, `arrive`, `mirror`, `choreography`, `invent` and `dance` (on
the beat); `stance` (all of it in a file).
"""
