"""The integrators of an operation against the closed form and against each other."""
