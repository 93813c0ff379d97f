"""The friction formula beside a mixing-length solution: text, computation and data."""
