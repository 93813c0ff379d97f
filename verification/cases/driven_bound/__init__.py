"""Appendix B of the driven-mass paper: a bound on the rotor's motion."""
