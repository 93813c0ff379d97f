"""Section 3.1 of the liquid-ring paper: at most one half of a chamber."""
