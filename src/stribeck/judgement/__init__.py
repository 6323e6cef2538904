"""What may be said of a fit: excitation, weakness, verdicts."""
