"""What each thing that a rung of the tube's flow may leave out is worth, before the flow is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.physics.tube_friction import turbulent_share
from ringbalance.physics.tube_numbers import reynolds_number, rotation_reynolds_number
from ringbalance.reduced_model.chamber_terms import MEAN, PLATES, chamber_contributions
from ringbalance.reduced_model.chamber_values import by_closed_form
from ringbalance.reduced_model.gravity import closed_ring
from ringbalance.reduced_model.law_building import column_pressure
from ringbalance.reduced_model.loss_rungs import CORRELATIONS, ROTATING, loss_at, velocity_under_head
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.rungs import Contribution
from ringbalance.scene.models import Scene

SHARES: Final = (0.15, 0.3, 0.5, 0.7, 0.85)
"""Fills of the driven chamber at which the flow is judged, as shares of max_fill_ratio."""

LOSS: Final = "k as a function of velocity"
ROTATION: Final = "friction by rotation"
TABLE: Final = "finite elements for rotation and ends"
LEVEL: Final = "plates, in the level of a chamber"
GRAVITY: Final = "gravity, in the level of a chamber"
HUMP: Final = "priming and tearing over the hump"
_RECALLED: Final = 0.3
"""Share of the rotation term that its correlations may be off by, from their distance to the tables."""
_LAMINAR_ENDS: Final = 1.3
"""What laminar ends add to k."""
_CREEPING_ENDS: Final = 12 * np.pi
"""The same times Re where the flow creeps."""


@dataclass(frozen=True, kw_only=True)
class FlowEstimate:
    """The tube's flow at equal fills as the correlations have it, a full siphon."""

    velocity: float
    """m/s; zero without gas pressure."""
    k: float
    reynolds: float
    rotation_reynolds: float
    rotation_share: float
    """Of k + 1, by the correlations."""
    laminar_share: float
    """1 laminar, 0 turbulent."""


def flow_estimate(scene: Scene) -> FlowEstimate:
    """Estimate the flow at equal fills from the gas pressure alone.

    Args:
        scene: the scene.

    Returns:
        FlowEstimate.

    Source: (k + 1) u^2/2 = p/rho with the correlations' k.
    """
    tube, nu = scene.tube, scene.liquid.kinematic_viscosity
    rotation = rotation_reynolds_number(
        angular_velocity=scene.rotor.speed, bore=tube.bore, kinematic_viscosity=nu
    )
    if scene.gas.pressure <= 0:
        return FlowEstimate(
            velocity=0.0,
            k=0.0,
            reynolds=0.0,
            rotation_reynolds=rotation,
            rotation_share=0.0,
            laminar_share=1.0,
        )
    u = velocity_under_head(scene, loss=CORRELATIONS, head=scene.gas.pressure / scene.liquid.density)
    k = float(loss_at(scene, loss=CORRELATIONS, velocity=u).k)
    turning = float(loss_at(scene, loss=ROTATING, velocity=u).k)
    re = float(reynolds_number(velocity=u, bore=tube.bore, kinematic_viscosity=nu))
    return FlowEstimate(
        velocity=u,
        k=k,
        reynolds=re,
        rotation_reynolds=rotation,
        rotation_share=abs(turning - k) / (turning + 1),
        laminar_share=float(1 - turbulent_share(reynolds=re)),
    )


def loss_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """What the rungs of the loss leave out, relative to k + 1.

    Args:
        scene: the scene.

    Returns:
        Contributions by name; zero where the scene fixes k by decree, which all rungs then share.

    Source: stands with each.
    """
    flow = flow_estimate(scene)
    constant = abs((PAPER_DRAG_COEFFICIENT + 1) / (flow.k + 1) - 1)
    ends = _LAMINAR_ENDS + _CREEPING_ENDS / max(flow.reynolds, 1e-6)
    tables = _RECALLED * flow.rotation_share + flow.laminar_share * ends / (flow.k + 1)
    # Where the other branch rules, part of the rotation term still differs.
    tables += 0.02 * flow.rotation_share
    given = scene.tube.drag_coefficient is not None
    found = (
        (LOSS, constant, "|51/(k + 1) - 1| with k by correlations at equal fills", "definition of k"),
        (
            ROTATION,
            flow.rotation_share,
            "(k_rot - k)/(k_rot + 1), both by correlations",
            "Ito and Nanbu (1971)",
        ),
        (
            TABLE,
            tables,
            "0.3 of the rotation term, and (1.3 + 12 pi/Re)/(k + 1) while laminar",
            "spread of the correlations",
        ),
    )
    return {
        term: Contribution(
            term=term,
            value=0.0 if given else value,
            formula=formula,
            source=source,
            rough=term != LOSS,
        )
        for term, value, formula, source in found
    }


def flow_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """What the rungs of the flow leave out, relative to the velocity.

    Args:
        scene: the scene.

    Returns:
        Contributions by name; all rough, because none counts where the tube is blocked.

    Source: stands with each; u^2 is proportional to the head over k + 1.
    """
    half = {
        name: Contribution(
            term=name,
            value=None if c.value is None else c.value / 2,
            formula=f"half of {c.formula}",
            source=c.source,
            rough=True,
        )
        for name, c in loss_contributions(scene).items()
    }
    fills = scene.disc.max_fill_ratio * np.array(SHARES)
    chamber = chamber_contributions(scene, _closed(scene, fills))["pressures"]
    lever = _lever(scene)
    levels = {
        name: Contribution(
            term=name,
            value=None if chamber[of].value is None else chamber[of].value * lever,  # type: ignore[operator]
            formula=f"({chamber[of].formula}) |P_A - P_C|/(2 (p + P_A - P_C))",
            source=chamber[of].source,
            rough=True,
        )
        for name, of in ((LEVEL, PLATES), (GRAVITY, MEAN))
    }
    return half | levels | {HUMP: _hump(scene)}


def _closed(scene: Scene, fills: np.ndarray) -> np.ndarray:
    closed = closed_ring(
        disc=scene.disc,
        angular_velocity=scene.rotor.speed,
        gravity=scene.environment.gravity,
        vertical=scene.environment.shaft == "vertical",
        fill_ratio=fills,
    )
    return np.asarray(fills[closed])


def _levels(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Levels of the driven and of the opposite chamber at the points, Pa."""
    own = [by_closed_form(scene, scene.disc.max_fill_ratio * x).wall_pressure for x in SHARES]
    return np.array(own), np.array(own[::-1])


def _lever(scene: Scene) -> float:
    """How far a relative error of the levels reaches the velocity."""
    own, other = _levels(scene)
    surplus = scene.gas.pressure + own - other
    flows = surplus > 0
    if not np.any(flows):
        return 1.0
    return float(np.max(np.abs(own - other)[flows] / (2 * surplus[flows])))


def _hump(scene: Scene) -> Contribution:
    worth = 0.0 if scene.tube.hump_radius is None else _hump_worth(scene, scene.tube.hump_radius)
    return Contribution(
        term=HUMP,
        value=worth,
        formula="1 - u_separated/u_siphon, or 1 where the column to the hump outweighs the gas",
        source="energy balance up to the hump",
        rough=True,
    )


def _hump_worth(scene: Scene, radius: float) -> float:
    own, other = _levels(scene)
    column, rho = column_pressure(scene=scene, radius=radius), scene.liquid.density
    surplus = scene.gas.pressure + own - other
    flows = surplus > 0
    if np.any(flows & (scene.gas.pressure + own - column <= 0)):
        return 1.0
    if not np.any(flows):
        return 0.0
    cavity = scene.liquid.vapour_pressure - scene.gas.ambient_pressure
    margin = (scene.gas.pressure - cavity + own - column)[flows] / rho
    loss = loss_at(scene, loss=CORRELATIONS, velocity=max(flow_estimate(scene).velocity, 1e-6))
    full = np.sqrt(2 * surplus[flows] / rho / (float(loss.k) + 1))
    torn = np.sqrt(2 * np.maximum(margin, 0.0) / (float(loss.upstream_k) + float(loss.kinetic_factor)))
    return float(np.max(np.maximum(1 - torn / full, 0.0)))
