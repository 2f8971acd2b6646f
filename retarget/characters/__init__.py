"""Who plays the motion: read `target`, the one protocol, first; `castfile` and `cast`, who plays what, last.

Drawings: `drawing`, `bend`. Photographs: `photo`, `picture`; `backdrop` is what may be behind them. 3-D models:
`gltffile`, `meshfiles` and `objfiles` (files), `lift` (from the plane to space), `mesh`, `carried` (keys for a
model that has none). Jointed figures: `skin`, `bones`, `puppet`.
"""
