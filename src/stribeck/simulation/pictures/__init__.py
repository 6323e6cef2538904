"""Pictures of a simulated robot."""
