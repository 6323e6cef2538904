"""Makes logs of simulated robots, and their truth."""
