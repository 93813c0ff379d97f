"""How often half-widths hold, over random discs."""
