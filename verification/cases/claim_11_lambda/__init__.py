"""lambda in section 5.2 of the liquid-ring paper."""
