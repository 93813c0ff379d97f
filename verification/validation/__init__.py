"""Published measurements, and their differences from the model.

A data set is a CSV file in `data/`. Its first lines, marked #, are TOML: where the numbers come from, how
uncertain they are, and what they support. A new experiment is such a file, and a case of kind `validation`
that predicts its points.
"""
