"""Figures of the paper for any log: accelerations, double support, spectrum, power and sensitivity to inertias."""
