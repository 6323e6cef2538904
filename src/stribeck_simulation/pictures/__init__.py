"""What is drawn of a simulated robot."""
