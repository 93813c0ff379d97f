"""Estimation and control at their extremes: wrong assumptions, long steps, saturation, friction and noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from ringbalance.controller.eccentric_mass.estimation.imbalance_model import (
    dynamic_stiffness,
    euler_step_limit,
    euler_transition,
    whirl_transition,
)
from ringbalance.controller.eccentric_mass.plant.parameters import plant_parameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.strategy.settings import believed_whirl
from ringbalance.controller.eccentric_mass.strategy.targets import target_angles
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.verification.eccentric_mass.imbalance import (
    ImbalanceRecord,
    estimate_imbalance,
    imbalance_record,
)
from ringbalance.verification.eccentric_mass.scenes import at_constant_speed, changed

Belief = Literal["assumed_mass", "assumed_stiffness", "assumed_damping"]

NOISES = (1e-6, 1e-5, 1e-4, 1e-3, 5e-3)
"""Of the displacement sensors, m."""
FRICTION_PAIRS = ((0.0, 0.0), (0.01, 0.01), (0.004, 0.012), (0.0, 0.01))
"""Friction arms of both masses, m."""


@dataclass(frozen=True, kw_only=True)
class WrongBelief:
    """Estimated over true imbalance when one constant of the rotor is assumed wrong."""

    belief: Belief
    relative: FloatArray
    """Assumed over true value, less one, shape (n,)."""
    predicted: ComplexArray
    """D_believed/D_true, shape (n,)."""
    estimated: ComplexArray
    """By the filter, shape (n,)."""


@dataclass(frozen=True, kw_only=True)
class EulerMap:
    """Where the paper's transition grows, over step and speed."""

    step: FloatArray
    """s, shape (n,)."""
    speed: FloatArray
    """rad/s, shape (m,)."""
    growth: FloatArray
    """Spectral radius of the whirl's transition by Euler's rule, shape (n, m); above one it grows."""
    exact_growth: FloatArray
    """The same of the exact transition, always below one."""
    limit: FloatArray
    """Longest step that does not grow, s, shape (m,)."""


def wrong_belief(
    scene: EccentricScene,
    *,
    belief: Belief,
    relative: npt.ArrayLike,
    settling: float = 12.0,
    duration: float = 4.0,
) -> WrongBelief:
    """How a wrong stiffness, damping or mass carries over to the imbalance.

    In a steady whirl z = W^2 theta/D, so a filter that assumes D_b finds theta D_b/D.
    Args: `belief`: which constant is assumed wrong. `relative`: assumed over true value, less one, shape
        (n,). `settling`: time before the estimation begins, s, long against the rotor's decay: a filter that
        assumes wrong also misreads the start's transient. `duration`: of the estimation, s.
    """
    changes = np.asarray(relative, dtype=np.float64)
    record = _settled(imbalance_record(scene, duration=settling + duration), settling)
    true = dynamic_stiffness(model=believed_whirl(scene), angular_velocity=record.speed)
    value = getattr(scene.imbalance_filter, belief)
    scenes = [changed(scene, "imbalance_filter", **{belief: value * (1 + change)}) for change in changes]
    stiffness = [
        dynamic_stiffness(model=believed_whirl(one), angular_velocity=record.speed) for one in scenes
    ]
    found = [estimate_imbalance(one, record)[0][-1] for one in scenes]
    return WrongBelief(
        belief=belief,
        relative=changes,
        predicted=np.array([complex(one / true) for one in stiffness]),
        estimated=np.array([complex(x[4], x[5]) / record.imbalance for x in found]),
    )


def _settled(record: ImbalanceRecord, settling: float) -> ImbalanceRecord:
    """The record from when its start has died down."""
    kept = record.time > settling
    return replace(record, time=record.time[kept], samples=record.samples[kept])


def euler_map(scene: EccentricScene, *, steps: npt.ArrayLike, speeds: npt.ArrayLike) -> EulerMap:
    """Growth of the whirl in one step by Euler's rule and by the exact transition.

    Args: `steps`: s, shape (n,). `speeds`: rad/s, shape (m,).
    """
    step, speed = np.asarray(steps, dtype=np.float64), np.asarray(speeds, dtype=np.float64)
    model = believed_whirl(scene)

    def radius(transition: FloatArray) -> float:
        return float(np.max(np.abs(np.linalg.eigvals(transition[:4, :4]))))

    return EulerMap(
        step=step,
        speed=speed,
        growth=np.array([[radius(euler_transition(model, float(w), float(h))) for w in speed] for h in step]),
        exact_growth=np.array(
            [[radius(whirl_transition(model, float(w), float(h))) for w in speed] for h in step]
        ),
        limit=euler_step_limit(model=model, angular_velocity=speed),
    )


def saturation_curve(scene: EccentricScene, *, imbalances: npt.ArrayLike) -> FloatArray:
    """Imbalance that two masses leave, over the imbalance.

    Args: `imbalances`: U, kg m, shape (n,).
    Returns: kg m, shape (n,): zero until the masses lie side by side, then rising one for one.
    """
    moment = plant_parameters(scene).moment
    gap = scene.masses.arc_length / scene.masses.guide_radius
    values = np.asarray(imbalances, dtype=np.float64)
    return np.array([target_angles(float(u), 0.0, moment, gap).residual for u in values])


def friction_extremes(scene: EccentricScene, *, time_limit: float = 30.0) -> tuple[EccentricRun, ...]:
    """Runs without friction, with equal and with unequal friction.

    Args: `time_limit`: of each run, s.
    Returns: One run for each pair of `FRICTION_PAIRS`.
    """
    level = at_constant_speed(scene, time_limit=time_limit)
    return tuple(simulate_eccentric(changed(level, "masses", friction_arm=pair)) for pair in FRICTION_PAIRS)


def noise_extremes(
    scene: EccentricScene, *, noises: tuple[float, ...] = NOISES, time_limit: float = 60.0
) -> tuple[EccentricRun, ...]:
    """Runs under ever more noise, which the filter knows of; the velocity's noise grows alike.

    Args: `noises`: of the displacement sensors, m.
    """
    level = at_constant_speed(scene, time_limit=time_limit)
    per_position = scene.sensor.velocity_noise / scene.sensor.position_noise
    runs = []
    for noise in noises:
        pair = {"position_noise": noise, "velocity_noise": noise * per_position}
        noisy = changed(changed(level, "sensor", **pair), "imbalance_filter", **pair)
        runs.append(simulate_eccentric(noisy))
    return tuple(runs)
