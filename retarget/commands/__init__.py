"""The subcommands of `tooncap`, a function each, in the order of the work: start, capturing, many, lending."""
