"""Which terms each joint's friction has."""
