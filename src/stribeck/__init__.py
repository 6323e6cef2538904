"""Whole-body joint friction of legged robots and arms, from the logs they already record."""
