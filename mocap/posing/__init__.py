"""Posing and dancing (Chen et al. 2004): so far `beats`, when to move; the rest follows."""
