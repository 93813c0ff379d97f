"""Eqs. 9 to 11 of the liquid-ring paper."""
