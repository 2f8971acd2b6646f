"""Lend a captured motion to somebody else (Bregler et al. 2002, section 3.4).

Read `characters` (who plays), `stage` (the performance and its pictures), `export` (what goes out), `demos` (the
paper's examples), `cli` with `commands`, the `tooncap` command, and `workbench`, the same in a browser.
"""
