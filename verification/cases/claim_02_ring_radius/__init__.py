"""Eqs. 5 and 6 of the liquid-ring paper, and R1'min."""
