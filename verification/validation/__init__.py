"""Measurements by others, and how far a model is from them.

A data set is a CSV file in `data/` whose first lines, marked #, are TOML: where it comes from, its uncertainty and
what it supports. A new experiment is such a file, and a case of kind `validation` that predicts its points.
"""
