"""How a session reaches a page on this machine, and nobody else: read `wire`, `impatient`, then `server`."""
