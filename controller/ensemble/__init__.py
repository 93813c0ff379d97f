"""Monte-Carlo ensembles: compiled closed-loop runs over uncertain inputs and noise.

A new uncertain input is drawn in `samples`; what a compiled run does at each sample goes into the `compiled_`
modules and `transfer`, equal to the interpreted loop.
"""
