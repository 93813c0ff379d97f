"""Steady laminar flow by finite elements: the solver, its meshes, and the tube's sections and ends.

It makes the tables of `physics.tube` (through `tools/`), checks them, and draws the report's flow fields; no
calibration runs it. A new flow geometry is a module here, with a mesh from `meshes` and a system from
`system`.
"""
