"""Inverse dynamics of rooted and of constrained trees, and how a root moves."""
