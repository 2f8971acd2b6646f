"""Motion capture made cartoon-like: so far `skeleton`, joints and how their turns are mixed; the rest follows."""
