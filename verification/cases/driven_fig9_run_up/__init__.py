"""Fig. 9 of the driven-mass paper: through the critical speed, balanced below it."""
