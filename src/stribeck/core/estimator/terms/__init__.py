"""Selection of each joint's friction terms."""
