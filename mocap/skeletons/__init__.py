"""Joints over time, as they are captured.

Read `skeleton`, then `bvh` with `bvhtext` and `euler`, and `units`.  Turns are mixed by `rotations`, and in bulk by
`quaternions`.
"""
