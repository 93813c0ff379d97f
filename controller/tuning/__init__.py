"""Tuning: the loop about the balanced state, the gain to use, its margins, and how long settling then takes.

A further controller's loop factor goes into `loop_factor`; what `ringbalance tune` reports, into `tune`.
"""
