"""Which motion would make friction known, and the trajectory of it (docs/plan.md)."""
