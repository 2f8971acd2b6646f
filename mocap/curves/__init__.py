"""What may be done to any curve over time, of joints or of cartoons.

Read `ends`, `filters` (Wang et al. 2006), `joint_filters`, `cartoon_curves` and `timing`.
"""
