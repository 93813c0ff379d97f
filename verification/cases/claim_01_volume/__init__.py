"""Eqs. 2 to 4 of the liquid-ring paper."""
