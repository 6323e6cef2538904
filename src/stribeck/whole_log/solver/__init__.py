"""From equations to a solution: pilot fit, normal equations, Gauss-Newton, empirical Bayes."""
