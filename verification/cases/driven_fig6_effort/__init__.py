"""Fig. 6 of the driven-mass paper: what positioning costs over the speed."""
