"""Types, findings, files and processes that every room uses."""
