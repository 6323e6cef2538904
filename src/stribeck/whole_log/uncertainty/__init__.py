"""How well the solution is known, and why."""
