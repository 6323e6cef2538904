"""From a log to the weak form of its equation of motion: what the whole-log fit weighs."""
