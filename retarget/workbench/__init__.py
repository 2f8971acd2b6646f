"""The workbench: the same work as the command line's, by hand and by eye, in a browser or a notebook.

Read `figure` and `state` (what is worked on, and its files), `history` (undo), `desks` (what a desk is, and how
messages reach its actions) with `fields`, `saving`, `made` (what was exported), `working` and `worker` (what takes
long, in a process of its own), `session` (messages in, events out; no screen needed); then the rooms of the desks,
`folder`, `capturing`, `staging` and `posing`, which `tables` lists; then `serving`, and `widget`, the same in a
notebook.  The page is in `static`, in rooms of those names.
"""
