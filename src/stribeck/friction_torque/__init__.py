"""Every sample's friction torque: worked out, thinned for the fit, and written as a table."""
