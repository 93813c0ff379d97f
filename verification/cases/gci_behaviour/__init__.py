"""Grid convergence on sequences whose limit is known."""
