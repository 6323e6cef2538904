"""What sensors make of exact values."""
