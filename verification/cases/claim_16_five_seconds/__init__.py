"""Fig. 8 of the liquid-ring paper."""
