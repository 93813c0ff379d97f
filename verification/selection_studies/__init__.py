"""Studies of the selection of models: error against cost, measured on the scene and on random scenes.

What each model leaves out, and what that is worth, is the registry's (`ringbalance.reduced_model.selection`).
A new quantity to select models for is one more hierarchy in `study`; what it costs is measured in `measure`.
"""
