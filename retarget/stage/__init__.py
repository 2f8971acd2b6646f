"""The performance: read `perform` (motion meets target), then `draw2d` (pictures of it)."""
