"""Fig. 8 of the driven-mass paper: errors of ten degrees, and fine tuning."""
