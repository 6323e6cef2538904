"""How large errors are and how they are correlated."""
