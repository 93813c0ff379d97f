"""Eq. 12 of the liquid-ring paper."""
