"""The drag coefficient of section 3.2 of the liquid-ring paper."""
