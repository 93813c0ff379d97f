"""The liquid-ring paper's closed formulas, one function each, as printed.

Nothing is corrected here: a corrected or extended formula belongs to `ringbalance.reduced_model.chamber` or
`tube`.
"""
