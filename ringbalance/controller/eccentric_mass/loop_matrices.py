"""Matrices, gains and targets of the loop with two eccentric masses, as a control engineer writes it down."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ringbalance.controller.eccentric_mass.friction_filter import friction_flow
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import StrategySettings
from ringbalance.controller.eccentric_mass.targets import target_angles
from ringbalance.results.result import csv_text
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.narrowing import scene_as


@dataclass(frozen=True, kw_only=True)
class EccentricLoop:
    """Matrices, gains and targets of a scene's strategy, at n constant speeds of the rotor, SI.

    Imbalance filter: state (x, y, x', y', U_x, U_y) along the rotor's axes, samples (x, y, x', y').
    Friction filter of each mass: state (rate, friction arm), linear about the drive speed and the scene's
    arms, with the rate as sample.

    Example:
        >>> loop = rb.eccentric_loop(rb.load_scene("eccentric_mass_paper"))
        >>> isinstance(loop, rb.EccentricLoop), loop.targets.shape
        (True, (2,))
    """

    speed: FloatArray
    """Constant speeds of the profile, rad/s, shape (n,)."""
    transition: FloatArray
    """F over one step of the imbalance filter, shape (n, 6, 6)."""
    process: FloatArray
    """Q, shape (n, 6, 6)."""
    observation: FloatArray
    """H, shape (n, 4, 6)."""
    measurement: FloatArray
    """R of the rotor's sensor, shape (4, 4); the encoders' noise is added as the masses stand."""
    filter_step: float
    """Step of the imbalance filter, s."""
    position_gain: float
    """k_p of u = -k_p (phi - phi_d) - k_d phi', N m/rad."""
    rate_gain: float
    """k_d, N m s/rad."""
    torque_per_volt: float
    """Torque of a drive at standstill, N m/V."""
    friction_transition: FloatArray
    """F of the friction filter by speed and mass, shape (n, 2, 2, 2)."""
    friction_process: FloatArray
    """Q of the friction filter by speed and mass, shape (n, 2, 2, 2)."""
    friction_measurement: float
    """R of the friction filter, rad^2/s^2."""
    friction_step: float
    """Step of the friction filter, s."""
    drive_speed: float
    """Rate at which the masses go round while their friction is estimated, rad/s."""
    speed_gain: float
    """Gain on the error of that rate, V s/rad."""
    pair_gain: float
    """Gain on the error of the angle between the masses, V/rad."""
    targets: FloatArray
    """Angles of the masses that cancel the scene's imbalance, rad, shape (2,)."""

    @property
    def csv(self) -> str:
        """A row for each number: name, indices from 0 on, and value."""
        columns: dict[str, list[str]] = {"name": [], "index": [], "value": []}
        for each in fields(self):
            for index, value in np.ndenumerate(getattr(self, each.name)):
                row = each.name, " ".join(map(str, index)), repr(float(value))
                for column, text in zip(columns.values(), row, strict=True):
                    column.append(text)
        head = "# SI; vectors and matrices by their indices; meanings in ringbalance.EccentricLoop\n"
        return head + csv_text(columns)


def eccentric_loop(scene: EccentricScene) -> EccentricLoop:
    """Matrices, gains and targets of a scene's strategy.

    Raises: SceneError: another balancer, see `linear_loop`.

    Example:
        >>> loop = rb.eccentric_loop(rb.load_scene(rb.bundled_scene("eccentric_mass_paper")))
        >>> loop.transition.shape
        (2, 6, 6)
    """
    scene = scene_as(EccentricScene, scene)
    settings, arms = StrategySettings.of(scene), scene.masses.friction_arm
    law, filter_, friction, sensor = settings.law, settings.filter, settings.friction, settings.sensor
    step, noise, speeds = settings.step * friction.every, friction.noise, filter_.speed
    transition, process = np.zeros((len(speeds), 2, 2, 2)), np.zeros((len(speeds), 2, 2, 2))
    wander = noise.arm * step
    for (i, speed), (k, arm) in ((a, b) for a in enumerate(speeds.tolist()) for b in enumerate(arms)):
        _, by_rate, by_arm = friction_flow(
            friction.track, friction.drive_speed, arm, speed, 0.0, step, friction.euler
        )
        transition[i, k] = [[by_rate, by_arm], [0.0, 1.0]]
        both = by_arm * wander / 2
        process[i, k] = [[by_arm**2 * wander / 3 + noise.acceleration * step, both], [both, wander]]
    imbalance = scene.imbalance.mass * scene.imbalance.radius
    first, second, *_ = target_angles(imbalance, scene.imbalance.phase, law.track.moment, scene.masses.gap)
    return EccentricLoop(
        speed=speeds,
        transition=filter_.transition,
        process=filter_.process,
        observation=filter_.observation,
        measurement=np.diag([sensor.position**2] * 2 + [sensor.velocity**2] * 2),
        filter_step=filter_.step,
        position_gain=law.position_gain,
        rate_gain=law.rate_gain,
        torque_per_volt=law.torque_per_volt,
        friction_transition=transition,
        friction_process=process,
        friction_measurement=noise.rate_variance,
        friction_step=step,
        drive_speed=friction.drive_speed,
        speed_gain=friction.speed_gain,
        pair_gain=friction.pair_gain,
        targets=np.array([first, second]),
    )
