"""Forward dynamics with standing feet as rigid constraints (6.1)."""
