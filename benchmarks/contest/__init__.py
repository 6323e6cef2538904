"""The public benchmark: logs with known friction, methods that identify it, and a table of their errors."""
