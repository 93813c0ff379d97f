"""Pressure of the liquid in a rotating chamber by finite elements, and the ring quantities from it.

A new effect on the liquid at rest, such as surface tension on the free surface, goes here: its condition
into `surface`, its integrals into `loads`, and its effect on moment and wall pressure into `ring`.  On a mesh
from a file, `loads.solved_ring` solves with quadratic tetrahedra.
"""
