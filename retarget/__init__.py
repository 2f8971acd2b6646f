"""Lend a captured motion to somebody else (Bregler et al. 2002, section 3.4).

Read `characters` (who plays), `stage` (the performance and its pictures), `export` (what goes out) and
`cli`, the `tooncap` command.
"""
