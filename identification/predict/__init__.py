"""Predictions of what was measured, one module per kind of data, through the program's own laws.

A module gives `predict(scene, observations, lambda_factor)`; a new kind is declared in `data/` as well.
"""
