"""The tube's flow over a scene's range of fills, by correlations, before the flow is solved."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.physics.gas import pressure_factor
from ringbalance.reduced_model.chamber.values import by_closed_form
from ringbalance.reduced_model.law.building import tube_path
from ringbalance.reduced_model.selection.loss_models import CORRELATIONS, ROTATING, velocity_under_head
from ringbalance.reduced_model.tube.regime import TubeEnds, can_flow, column_flow
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.loop_models import Sensor
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import FINEST_MODELS

SHARES: Final = (0.15, 0.3, 0.5, 0.7, 0.85)
"""Fills of the driven chamber at which the flow is judged, as shares of max_fill_ratio."""
_NO_PRESSURE: Final = 1.0
"""Gauge, Pa, at or below which the gas drives nothing."""
_LEAST_HEAD: Final = 1e-16
"""H without loss at 1e-8 m/s, the slowest flow that is looked for, m^2/s^2."""
_VELOCITIES: Final = 25


def steady(scene: Scene) -> Scene:
    """The scene with fixed values of what no steady flow depends on, tuning and draws of a loop, and without
    a choice of models."""
    return replace(
        scene,
        tube=replace(scene.tube, models=FINEST_MODELS),
        rotor=replace(
            scene.rotor, influence_coefficient=1.0, lag_angle=0.0, initial_amplitude=1.0, initial_phase=0.0
        ),
        sensor=Sensor(amplitude_noise=0.0, phase_noise=0.0),
        controller=replace(
            scene.controller,
            kind="target_vector",
            limit=1.0,
            period=1.0,
            hold_time=1.0,
            proportional=1.0,
            first_trial=1.0,
            long_step=1.0,
            short_step=1.0,
        ),
        run=replace(scene.run, seed=0, time_limit=1.0),
    )


@lru_cache(maxsize=8)
def equal_velocity(scene: Scene) -> float:
    """Velocity of a full siphon at equal fills by the correlations, m/s; zero without gas pressure.

    Source: (k + 1) u^2/2 = p/rho.
    """
    head = pressure_factor(scene) * scene.gas.pressure / scene.liquid.density
    return float(velocity_under_head(scene, loss=CORRELATIONS, head=head)) if head >= _LEAST_HEAD else 0.0


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
    ends, crest, rho = range_ends(scene), tube_path(scene).crest, scene.liquid.density
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
        starts=np.asarray(can & (scene.gas.pressure > _NO_PRESSURE)),
    )


def _velocities(scene: Scene, head: FloatArray, *, to_crest: bool) -> FloatArray:
    """m/s; zero where no head drives."""
    found = np.zeros(head.shape)
    drives = head > 0
    found[drives] = velocity_under_head(scene, loss=ROTATING, head=head[drives], to_crest=to_crest)
    return found


def flows(scene: Scene) -> bool:
    """Whether anything flows at some fill of the range."""
    return bool(np.any(range_flow(scene).velocity > 0))


def range_velocities(scene: Scene) -> FloatArray:
    """Velocities at which the loss is judged, m/s: from a quarter of the slowest flow, full or separated,
    over the range of fills to twice the fastest; about that under the gas alone where nothing flows."""
    flow = range_flow(scene)
    found = np.concatenate([flow.siphon, flow.separated])
    if not flows(scene):
        found = np.array([equal_velocity(scene) or 1.0])
    found = np.log(found[(found > 0) & np.isfinite(found)])
    return np.exp(np.linspace(np.min(found) - np.log(4), np.max(found) + np.log(2), _VELOCITIES))


def range_ends(scene: Scene) -> TubeEnds[FloatArray]:
    """Pressures at the tube's ends at the points, by the closed form."""
    own = np.array([by_closed_form(scene, scene.disc.max_fill_ratio * x).wall_pressure for x in SHARES])
    return TubeEnds(
        upstream_gas=np.full_like(own, pressure_factor(scene) * scene.gas.pressure),
        downstream_gas=np.zeros_like(own),
        upstream_hydrostatic=own,
        downstream_hydrostatic=own[::-1],
        port_pressure=tube_path(scene).port_pressure,
    )
