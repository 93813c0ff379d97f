"""Calibration from measurements: parameters of a built balancer, fitted to records of a test rig.

`reading.py` reads the files of measurements; `kinds/` predicts each kind of measurement by the program's
models; the other modules are likelihood, optimum, intervals, verdicts, and criticism of the fit.
"""
