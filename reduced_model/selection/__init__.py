"""Selection of models: which physical terms a scene needs, by estimated contribution.

A new physical term is entered here, with its models in order of cost, the estimate of its contribution and
its text; the models themselves live in `ringbalance.reduced_model.chamber` or `tube`.  What compares models
by error and cost is a study, `ringbalance.verification.selection_studies`.
"""
