"""Kinds of measurement: meaning and unit of each column, and its prediction; all in `reading.KINDS`."""
