"""Size and correlation of the equations' errors."""
