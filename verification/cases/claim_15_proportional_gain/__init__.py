"""Fig. 7 of the liquid-ring paper."""
