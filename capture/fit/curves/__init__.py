"""Curves before they are motion: which point of one is which of the other, and the line inside a shape.

Read `correspond` (points of contours), `monotone` (its dynamic programming) and `medial` (a matte's middle line).
"""
