"""Jointed figures as characters.

Read `skin` and `bones`, then `puppet` (keys by joint angles), `rubber_skin` and `hoses` (made of rubber), `dancer`.
"""
