"""Finite-element solves and correlations: pressure field, ring quantities, tube flow, grid convergence."""

from ringbalance.physics.grid_convergence import GridConvergence, Verdict, gci
from ringbalance.physics.pressure import (
    PressureProblem,
    PressureSolution,
    RotatingLiquid,
    solve_pressure,
)
from ringbalance.physics.pressure_surface import find_surface, solve_with_gravity
from ringbalance.physics.results import Estimate, Statistics, Status, StatusCode
from ringbalance.physics.ring import RingQuantities, ring_quantities

__all__ = [
    "Estimate",
    "GridConvergence",
    "PressureProblem",
    "PressureSolution",
    "RingQuantities",
    "RotatingLiquid",
    "Statistics",
    "Status",
    "StatusCode",
    "Verdict",
    "find_surface",
    "gci",
    "ring_quantities",
    "solve_pressure",
    "solve_with_gravity",
]
