"""Studies of accuracy, each one command."""
