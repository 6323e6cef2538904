"""Checks of the fit: validation on held-out segments, and misfits of the law."""
