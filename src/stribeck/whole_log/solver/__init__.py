"""From equations to a fit: pilot, accumulation, elimination, Gauss-Newton, empirical Bayes."""
