"""Calibration from measurements: parameters of a built disc, fitted to what a test rig recorded.

`data/` reads the files of measurements; `predict/` predicts each kind of them through the
program's own laws; likelihood, intervals, verdicts and criticism of the model stand beside them.
"""
