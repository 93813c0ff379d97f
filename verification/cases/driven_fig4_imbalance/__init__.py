"""Fig. 4 of the driven-mass paper: how fast the imbalance becomes known."""
