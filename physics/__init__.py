"""Finite-element solves and correlations: pressure field, ring quantities, tube flow, grid convergence."""

from ringbalance.physics.end_losses_table import laminar_entrance_loss, laminar_exit_loss
from ringbalance.physics.flow_fields import (
    EndFlow,
    SectionFlow,
    entrance_flow,
    exit_flow,
    section_flow,
)
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
from ringbalance.physics.sloshing import SloshingModes, resonant_fills, sloshing_modes
from ringbalance.physics.sloshing_response import SloshingResponse, sloshing_response
from ringbalance.physics.tube_loss import FlowState, TubeLoss, tube_loss
from ringbalance.physics.tube_numbers import reynolds_number, rotation_reynolds_number

__all__ = [
    "EndFlow",
    "Estimate",
    "FlowState",
    "GridConvergence",
    "PressureProblem",
    "PressureSolution",
    "RingQuantities",
    "RotatingLiquid",
    "SectionFlow",
    "SloshingModes",
    "SloshingResponse",
    "Statistics",
    "Status",
    "StatusCode",
    "TubeLoss",
    "Verdict",
    "entrance_flow",
    "exit_flow",
    "find_surface",
    "gci",
    "laminar_entrance_loss",
    "laminar_exit_loss",
    "resonant_fills",
    "reynolds_number",
    "ring_quantities",
    "rotating_friction_ratio",
    "rotation_reynolds_number",
    "section_flow",
    "sloshing_modes",
    "sloshing_response",
    "solve_pressure",
    "solve_with_gravity",
    "tube_loss",
]
