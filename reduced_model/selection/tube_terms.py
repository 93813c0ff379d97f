"""What each thing that a model of the tube's flow may leave out is worth, before the flow is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.physics.tube.friction import turbulent_share
from ringbalance.physics.tube.numbers import reynolds_number, rotation_reynolds_number
from ringbalance.reduced_model.chamber.gravity import closed_ring
from ringbalance.reduced_model.chamber.terms import MEAN, PLATES, chamber_contributions
from ringbalance.reduced_model.chamber.values import by_closed_form
from ringbalance.reduced_model.contribution import Contribution
from ringbalance.reduced_model.law.building import tube_path
from ringbalance.reduced_model.paper.formulas import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.selection.loss_models import (
    CORRELATIONS,
    ROTATING,
    loss_at,
    velocity_under_head,
)
from ringbalance.reduced_model.tube.regime import SiphonCrest, TubeEnds, can_flow, column_flow
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene

SHARES: Final = (0.15, 0.3, 0.5, 0.7, 0.85)
"""Fills of the driven chamber at which the flow is judged, as shares of max_fill_ratio."""

LOSS: Final = "k as a function of velocity"
ROTATION: Final = "friction by rotation"
TABLE: Final = "finite elements for rotation and ends"
LEVEL: Final = "plates, in the level of a chamber"
GRAVITY: Final = "gravity, in the level of a chamber"
NO_PRESSURE: Final = 1.0
"""Gauge, Pa, at or below which the gas drives nothing."""
HUMP: Final = "priming and separation over the siphon crest"
_LEAST_HEAD: Final = 1e-16
"""H without loss at 1e-8 m/s, the slowest flow that is looked for, m^2/s^2."""
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


@lru_cache(maxsize=8)
def flow_estimate(scene: Scene) -> FlowEstimate:
    """Estimate the flow at equal fills from the gas pressure alone.

    Source: (k + 1) u^2/2 = p/rho with the correlations' k.
    """
    tube, nu = scene.tube, scene.liquid.kinematic_viscosity
    rotation = rotation_reynolds_number(
        angular_velocity=scene.rotor.speed, bore=tube.bore, kinematic_viscosity=nu
    )
    head = scene.gas.pressure / scene.liquid.density
    if head < _LEAST_HEAD:
        return FlowEstimate(
            velocity=0.0,
            k=0.0,
            reynolds=0.0,
            rotation_reynolds=rotation,
            rotation_share=0.0,
            laminar_share=1.0,
        )
    u = float(velocity_under_head(scene, loss=CORRELATIONS, head=head))
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


@dataclass(frozen=True, kw_only=True)
class RangeFlow:
    """The tube's flow over the fills of `SHARES` by correlations with rotation; arrays along the fills."""

    driving_pressure: FloatArray
    """On the full column, Pa."""
    siphon: FloatArray
    """Velocity of a full siphon, m/s; zero without a driving pressure."""
    separated: FloatArray
    """Velocity of a column separated at the crest, m/s, of one that spills where gas stays there; infinite
    without a crest, zero where it blocks."""
    starts: BoolArray
    """Whether the gas starts a flow in an unprimed tube."""

    @property
    def velocity(self) -> FloatArray:
        """The smaller of both, m/s."""
        return np.minimum(self.siphon, self.separated)


@lru_cache(maxsize=8)
def range_flow(scene: Scene) -> RangeFlow:
    """Estimate the flow over the range of fills, the opposite chamber with the rest of the pair's liquid.

    Source: `tube_regime`, with closed-form chambers and a loss from correlations.
    """
    ends, crest, rho = _ends(scene), tube_path(scene).crest, scene.liquid.density
    driving = ends.driving_pressure()
    separated = np.full(driving.shape, np.inf)
    if crest is not None:
        separated = column_flow(
            ends=ends,
            crest=crest,
            primed=False,
            allowed=True,
            siphon=lambda pressure, flows: _velocities(scene, flows * pressure / rho, to_crest=False),
            separation=lambda pressure, flows: _velocities(scene, flows * pressure / rho, to_crest=True),
        ).separation_velocity
    can = can_flow(ends=ends, crest=crest, primed=False)
    return RangeFlow(
        driving_pressure=driving,
        siphon=_velocities(scene, driving / rho, to_crest=False),
        separated=separated,
        starts=np.asarray(can & (scene.gas.pressure > NO_PRESSURE)),
    )


def _velocities(scene: Scene, head: FloatArray, *, to_crest: bool) -> FloatArray:
    """m/s; zero where no head drives."""
    found = np.zeros(head.shape)
    drives = head > 0
    found[drives] = velocity_under_head(scene, loss=ROTATING, head=head[drives], to_crest=to_crest)
    return found


def loss_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """What the models of the loss leave out, relative to k + 1.

    Returns: Contributions by name; zero where the scene prescribes k, which all models then share.
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
    """What the models of the flow leave out, relative to the velocity.

    Returns: Contributions by name; all rough, because none counts where the tube is blocked.
    Source: stands with each; u^2 is proportional to the head over k + 1.
    """
    flow = flow_estimate(scene)
    half = {name: _on_velocity(c) for name, c in loss_contributions(scene).items()}
    if half[LOSS].value:
        value = abs(((PAPER_DRAG_COEFFICIENT + 1) / (flow.k + 1)) ** 0.5 - 1)
        formula = "|sqrt(51/(k + 1)) - 1| with k by correlations at equal fills"
        half[LOSS] = replace(half[LOSS], value=value, formula=formula)
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


def _on_velocity(loss: Contribution) -> Contribution:
    """Half of the change of k + 1."""
    value = None if loss.value is None else loss.value / 2
    return replace(loss, value=value, formula=f"half of {loss.formula}", rough=True)


def _closed(scene: Scene, fills: np.ndarray) -> np.ndarray:
    closed = closed_ring(scene, fills)
    return np.asarray(fills[closed])


def _ends(scene: Scene) -> TubeEnds[FloatArray]:
    """Pressures at the tube's ends at the points, by the closed form."""
    own = np.array([by_closed_form(scene, scene.disc.max_fill_ratio * x).wall_pressure for x in SHARES])
    return TubeEnds(
        upstream_gas=np.full_like(own, scene.gas.pressure),
        downstream_gas=np.zeros_like(own),
        upstream_hydrostatic=own,
        downstream_hydrostatic=own[::-1],
        port_pressure=tube_path(scene).port_pressure,
    )


def _lever(scene: Scene) -> float:
    """How far a relative error of the wall pressures reaches the velocity."""
    ends = _ends(scene)
    driving = ends.driving_pressure()
    flows = driving > 0
    if not np.any(flows):
        return 1.0
    difference = np.abs(ends.upstream_hydrostatic - ends.downstream_hydrostatic)
    return float(np.max(difference[flows] / (2 * driving[flows])))


def _hump(scene: Scene) -> Contribution:
    crest = tube_path(scene).crest
    return Contribution(
        term=HUMP,
        value=0.0 if crest is None else _crest_contribution(scene, crest),
        formula="1 - u_separated/u_siphon, or 1 where the column to the siphon crest outweighs the gas",
        source="energy balance up to the siphon crest",
        rough=True,
    )


def _crest_contribution(scene: Scene, crest: SiphonCrest[FloatArray]) -> float:
    flow = range_flow(scene)
    flows = flow.driving_pressure > 0
    if np.any(flows & ~np.asarray(crest.primes(_ends(scene)))):
        return 1.0
    lost = 1 - flow.separated[flows] / flow.siphon[flows]
    return float(np.max(np.maximum(lost, 0.0), initial=0.0))
