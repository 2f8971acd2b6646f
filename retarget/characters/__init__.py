"""Who plays the motion: read `target`, the one protocol, then `drawing`, `picture`, `bend` and, last, `cast`."""
