"""How a session reaches a page, and nobody else; and how long work is done beside it.

Read `working` and `worker`, `wire`, `impatient`, then `server`.
"""
