"""Every closed formula of the liquid-ring paper, one function each, with the paper's equation number.

Pan, Wu, Gao and Mu, "Performance Analysis and Control Simulation of Pneumatic Liquid Online Automatic
Balancing System for Rotating Machinery".  The formulas stand here as printed, flat plate strips and all, so
that they can be compared with the exact geometry and the finite elements; nothing is corrected silently.
SI units throughout; gas pressures are gauge.  Where the paper writes 0.5 for the liquid of a pair as a share
of one chamber, these functions read the disc's `max_fill_ratio`.
"""

from __future__ import annotations

from ringbalance.reduced_model.paper.chamber import (
    capacity,
    chamber_area_paper,
    chamber_volume_paper,
    flat_strip_area,
    initial_liquid_volume_paper,
    max_liquid_volume_paper,
    moment_paper,
    sector_area,
    surface_radius_paper,
)
from ringbalance.reduced_model.paper.flow import (
    PAPER_DRAG_COEFFICIENT,
    departure,
    ring_pressure,
    stall_pressure,
    velocity_from_pressures,
    velocity_from_volumes,
    velocity_paper,
    wall_pressure_paper,
)
from ringbalance.reduced_model.paper.transfer import (
    PAPER_LAMBDA,
    correction_mass,
    correction_moment,
    explicit_segment,
    residual_vibration,
)

__all__ = [
    "PAPER_DRAG_COEFFICIENT",
    "PAPER_LAMBDA",
    "capacity",
    "chamber_area_paper",
    "chamber_volume_paper",
    "correction_mass",
    "correction_moment",
    "departure",
    "explicit_segment",
    "flat_strip_area",
    "initial_liquid_volume_paper",
    "max_liquid_volume_paper",
    "moment_paper",
    "residual_vibration",
    "ring_pressure",
    "sector_area",
    "stall_pressure",
    "surface_radius_paper",
    "velocity_from_pressures",
    "velocity_from_volumes",
    "velocity_paper",
    "wall_pressure_paper",
]
