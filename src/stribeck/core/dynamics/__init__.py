"""Inverse dynamics of rooted and of constrained trees, and the motion of their root."""
