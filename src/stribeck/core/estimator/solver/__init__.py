"""Solution of the equations: pilot, accumulation, elimination, Gauss-Newton, empirical Bayes."""
