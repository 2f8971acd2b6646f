"""One character that plays several parts.

Read `shares` (whose is what) and `body`, then `heat`, `marked` and `markfiles` (drawings with marked joints).
"""
