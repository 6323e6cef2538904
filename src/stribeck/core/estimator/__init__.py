"""Friction of all joints at once from the whole log, by whitened equations in weak form."""
