"""Losses of the connecting tube, laminar to turbulent: friction, rotation, ends, bends; with uncertainty.

A new correlation is a module of its own that `state` adds to the terms of k, with its range of validity in
`loss` and its uncertainty in `uncertainty`. Tables that finite elements produced are read here and generated
in tools/.
"""
