"""Section 4.2 and the conclusions of the liquid-ring paper."""
