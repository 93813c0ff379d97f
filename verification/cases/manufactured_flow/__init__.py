"""The laminar flow solver against a manufactured solution."""
