"""Friction of all joints at once from the whole log, each equation weighed by what it can know."""
