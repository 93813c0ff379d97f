"""Finite-element solves and correlations: pressure field, ring quantities, tube flow, grid convergence."""

from ringbalance.physics.end_losses_table import laminar_entrance_loss, laminar_exit_loss
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
from ringbalance.physics.rotating_section_table import rotating_friction_ratio
from ringbalance.physics.tube_loss import FlowState, TubeLoss, tube_loss
from ringbalance.physics.tube_numbers import reynolds_number, rotation_reynolds_number

__all__ = [
    "Estimate",
    "FlowState",
    "GridConvergence",
    "PressureProblem",
    "PressureSolution",
    "RingQuantities",
    "RotatingLiquid",
    "Statistics",
    "Status",
    "StatusCode",
    "TubeLoss",
    "Verdict",
    "find_surface",
    "gci",
    "laminar_entrance_loss",
    "laminar_exit_loss",
    "reynolds_number",
    "ring_quantities",
    "rotating_friction_ratio",
    "rotation_reynolds_number",
    "solve_pressure",
    "solve_with_gravity",
    "tube_loss",
]
