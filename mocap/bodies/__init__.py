"""What a skeleton's joints are of a body, and where that stands.

Read `body`, which tells parts by `bodynames` or by `bodyshape`, and `contacts`; then `reach`, limbs turned until they
are where they must be, and `planted`, feet that stand by it.
"""
