"""Keys for who has none.

Read `ways` (how the source turns and stretches), `hinged`, `propose` and `proposals` (drawings, for an animator to
correct), `along` and `carried` (photographs and models, as they are).
"""
