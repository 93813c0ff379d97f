"""Predictions of what was measured, for each kind of data, through the program's own laws.

A new kind is entered in `kinds`, with its `predict(scene, observations, models)`, and declared in `data/`.
"""
