"""What is checked of a log before friction is fitted: each check a function from evidence to findings."""
