"""Eqs. 13 to 18 of the liquid-ring paper."""
