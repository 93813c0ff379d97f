"""Kinds of measurement: what a column means, its unit, and how the program predicts it; all in `reading.KINDS`."""
