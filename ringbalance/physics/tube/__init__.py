"""Losses of the connecting tube, laminar to turbulent: friction, rotation, ends, bends; with uncertainty.

A new correlation is one that `state` adds to the terms of k, with its range of validity and its uncertainty
in `loss`. Tables that finite elements produced are read here and generated in tools/.
"""
