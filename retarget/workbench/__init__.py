"""The workbench: the same work as the command line's, by hand and by eye, in a browser or a notebook.

Read `state` (what is worked on, and its files), `history` (undo), `desks` (what a desk is, and how messages reach its
actions), `session` (messages in, events out; no screen needed), then the desks themselves, `capture_desk` with
`capture_work` and `folder`, `pictures`, `working` and `worker` (what takes long, in a process of its own), and
`server`.  The page is in `static`.
"""
