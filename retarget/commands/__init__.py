"""The subcommands of `tooncap`, a function each.

In the order of the work: `start`, `capturing`, `many`, `exaggerating`, `proposing`, `lending`; `moving`, `rubbering`,
`filtering`, `analogies`, `playing`, `posing` and `dancing` for motion capture; `working`, the workbench.
"""
