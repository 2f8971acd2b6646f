"""3-D models as characters.

Read `model`, `gltffile`, `objfiles` and `meshfiles` (files), `lift` (from the plane to space) and `mesh`.
"""
