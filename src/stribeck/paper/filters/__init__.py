"""Filters of chapter 7, and the choice of their cutoff."""
