"""Files of measurements: the one reader that validation and `fit` share, the kinds for a fit, the template.

A new kind for a fit is a `DataKind` in `kinds`, predicted in `predict/`.
"""
