"""Eqs. 21 and 22 of the liquid-ring paper against Eqs. 7 and 8."""
