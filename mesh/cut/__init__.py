"""Integrals over the liquid in a chamber that a mesh file gives: volume, moment and wall pressure by surface.

Every integral is one over the chamber's walls: `patches` are the walls, `integrals` adds up what lies outside
a free surface, `table` keeps it for all concentric surfaces, `tilted` does it under gravity, `faceting` says
how well the mesh draws curved walls.
"""
