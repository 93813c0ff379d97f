"""Eq. 20 of the liquid-ring paper."""
