"""The conclusion of the liquid-ring paper on changing the balancing liquid."""
