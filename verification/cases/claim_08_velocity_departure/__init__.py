"""Eq. 19 and Fig. 4 of the liquid-ring paper."""
