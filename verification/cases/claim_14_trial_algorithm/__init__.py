"""Fig. 6 of the liquid-ring paper."""
