"""Photographs as characters.

Read `photo` (a file made ready, cut out by a box) and `picture` (on a mesh, bent with it).
"""
