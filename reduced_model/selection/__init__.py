"""Selection of models: which physical terms a scene needs, by estimated contribution and by counted cost.

A new physical term is entered here, with its models in order of cost, the estimate of its contribution and
its text; the models themselves live in `ringbalance.reduced_model.chamber` or `tube`.
"""
