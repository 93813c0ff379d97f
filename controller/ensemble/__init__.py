"""Monte-Carlo ensembles: compiled closed-loop runs over uncertain inputs and noise.

A new uncertain input is drawn in `samples`; what a run does at each sample is in `compiled_loop`.
"""
