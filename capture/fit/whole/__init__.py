"""A captured clip as a whole: what its pictures say of every drawing, and what time says of all of them together.

Read `course` (a part drawing by drawing), `stack` (pictures side by side), `descend` (what they say, many drawings at
once) and `in_time` (the temporal prior); `capture.fit.refine` puts them together.
"""
