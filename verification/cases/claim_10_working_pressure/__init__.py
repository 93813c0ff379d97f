"""The working range after Eq. 19 of the liquid-ring paper."""
