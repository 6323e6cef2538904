"""Which terms a joint's friction has."""
