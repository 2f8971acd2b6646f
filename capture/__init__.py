"""Lift the motion out of a cartoon (Bregler et al. 2002).

Read `motion` first: the language in which motion is written down.  Then `pictures`: clips, mattes and
the description of a shot.  Then `fit`: the captures themselves.
"""
