"""Fig. 7 of the driven-mass paper: balanced by positioning alone."""
