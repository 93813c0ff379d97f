"""Eq. 7 of the liquid-ring paper."""
