"""Steady laminar flow by finite elements: the solver, its meshes, and the tube's sections and ends.

A new flow geometry is a module here with a mesh from `meshes` and a system from `system`. Flows that serve
only to verify the solver belong to `ringbalance.verification.reference`.
"""
