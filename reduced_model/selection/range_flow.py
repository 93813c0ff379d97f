"""The tube's flow over a scene's range of fills, by correlations, before the flow is solved.

The tube's loss by models, in order of cost: the paper's k = 50, `fluids`, `fluids` with rotation, tables.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.gas import pressure_factor
from ringbalance.physics.tube.state import TubeState, tube_state
from ringbalance.reduced_model.chamber.closed_forms import chamber_pressure
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.tube.flow import tube_path
from ringbalance.reduced_model.tube.heads import crest_head
from ringbalance.reduced_model.tube.regime import TubeEnds, can_flow, column_flow
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.loop_models import Sensor
from ringbalance.scene.models import Scene
from ringbalance.scene.tube_models import CORRELATION, FINEST_MODELS, LEFT_OUT, TubeModels

CONSTANT: Final = "k = 50"
CORRELATIONS: Final = "fluids"
ROTATING: Final = "fluids with rotation"
TABLES: Final = "finite-element tables"
CONSTANT_MODELS: Final = TubeModels(
    constant=PAPER_DRAG_COEFFICIENT, roughness=LEFT_OUT, rotation=LEFT_OUT, bends=LEFT_OUT, ends=LEFT_OUT
)
MODELS: Final = {
    CONSTANT: CONSTANT_MODELS,
    CORRELATIONS: TubeModels(rotation=LEFT_OUT, bends=CORRELATION, ends=CORRELATION),
    ROTATING: TubeModels(rotation=CORRELATION, bends=CORRELATION, ends=CORRELATION),
    TABLES: FINEST_MODELS,
}
LOSSES: Final = tuple(MODELS)
"""In order of increasing cost."""
_MOST_STEPS: Final = 60
_ROUND_OFF: Final = 1e-14


def with_loss(scene: Scene, loss: str) -> Scene:
    """The scene with one model of its tube's loss; where it prescribes k, with that k and alpha = 1 on all.

    Args: `loss`: one of `LOSSES`.
    Raises: ValueError: a model that does not exist.
    """
    if loss not in MODELS:
        raise ValueError(f"loss must be one of {', '.join(LOSSES)}, not {loss!r}")
    models = MODELS[loss] if scene.tube.drag_coefficient is None else CONSTANT_MODELS
    return replace(scene, tube=replace(scene.tube, models=models))


def loss_at(scene: Scene, *, loss: str, velocity: npt.ArrayLike) -> TubeState:
    """Loss of a scene's tube by one model of `LOSSES`, at velocities above zero, m/s, any shape.

    Raises: ValueError: a model that does not exist.
    """
    return tube_state(with_loss(scene, loss), velocity)


def head_at(scene: Scene, *, loss: str, velocity: FloatArray, to_crest: bool) -> FloatArray:
    """Head of a full tube, (k + 1) u^2/2, or of its column up to the crest's lowest pressure, m^2/s^2."""
    state = loss_at(scene, loss=loss, velocity=velocity)
    if not to_crest:
        return np.asarray((state.k + 1) * velocity**2 / 2)
    return crest_head(scene=scene, tube=scene.tube, state=state, velocity=velocity)


def velocity_under_head(
    scene: Scene, *, loss: str, head: npt.ArrayLike, to_crest: bool = False
) -> FloatArray:
    """Velocity of a full tube under a head, (k(u) + 1) u^2/2 = H, by bracketed secants in ln u and ln H.

    Args: `loss`: one of `LOSSES`. `head`: H, m^2/s^2, above zero, any shape. `to_crest`: whether the head
        acts up to the siphon crest alone: (alpha + k_up) u^2/2 = H.
    Source: definition of k; the head grows with u, so there is one root.
    """
    target = np.asarray(head, dtype=np.float64)
    low, high = np.full(target.shape, np.log(1e-8)), np.log(np.sqrt(2 * target) * 1.001 + 1e-6)
    y, slope, before = high, np.full(target.shape, 2.0), None
    for _ in range(_MOST_STEPS):
        found = head_at(scene, loss=loss, velocity=np.exp(y), to_crest=to_crest)
        excess = np.log(found / target)
        low, high = np.where(excess < 0, y, low), np.where(excess < 0, high, y)
        if before is not None:
            step, rise = y - before[0], excess - before[1]
            slope = np.where(np.abs(step) > 1e-9, rise / np.where(step == 0, 1.0, step), slope)
        before, ahead = (y, excess), y - excess / np.maximum(slope, 0.1)
        y = np.where((ahead > low) & (ahead < high), ahead, (low + high) / 2)
        y = np.where(np.abs(excess) < _ROUND_OFF, before[0], y)
        if np.all(np.abs(excess) < _ROUND_OFF):
            break
    return np.asarray(np.exp(y))


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
    own = chamber_pressure(scene=scene, fill_ratio=scene.disc.max_fill_ratio * np.array(SHARES))
    return TubeEnds(
        upstream_gas=np.full_like(own, pressure_factor(scene) * scene.gas.pressure),
        downstream_gas=np.zeros_like(own),
        upstream_hydrostatic=own,
        downstream_hydrostatic=own[::-1],
        port_pressure=tube_path(scene).port_pressure,
    )
