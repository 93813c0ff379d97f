"""The frozen, validated, SI-only records of a scene with two driven eccentric masses.

Angles are radians in the rotor's frame, positive with the rotation; amplitudes are zero-to-peak.  A walk is
the standard deviation gathered within 1 s, so its square is a spectral density: unit^2 / s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ringbalance.scene.models import RunSettings

Frame = Literal["rotor", "laboratory"]
Discretisation = Literal["exact", "euler"]
FrictionCompensation = Literal["break_away", "printed", "none"]
Strategy = Literal["whole", "locked"]


@dataclass(frozen=True, kw_only=True)
class SpeedPoint:
    """One corner of the speed profile."""

    time: float
    """s."""
    speed: float
    """rad/s."""


@dataclass(frozen=True, kw_only=True)
class EccentricRotor:
    """A rigid planar rotor on an isotropic linear bearing."""

    mass: float
    """m_r, with the imbalance, without the driven masses, kg."""
    stiffness: float
    """K_B, N/m."""
    damping: float
    """C_B, N s/m."""
    speed_profile: tuple[SpeedPoint, ...]
    """Corners in order of time; linear in between, constant outside."""


@dataclass(frozen=True, kw_only=True)
class Imbalance:
    """The imbalance of the rotor."""

    mass: float
    """m_im, kg; a part of the rotor's mass."""
    radius: float
    """r_im, m."""
    phase: float
    """phi_m in the rotor's frame, rad."""


@dataclass(frozen=True, kw_only=True)
class DrivenMasses:
    """Two equal masses on one circular track."""

    mass: float
    """m_b of each, kg."""
    guide_radius: float
    """r_b, m."""
    arc_length: float
    """l of each along the track, m."""
    initial_angle: tuple[float, float]
    """phi at the start, rad."""
    friction_arm: tuple[float, float]
    """mu_f of each, m: friction torque = mu_f m_b r_b (W + phi')^2."""


@dataclass(frozen=True, kw_only=True)
class Motor:
    """Motor and gears of one driven mass."""

    torque_constant: float
    """K_i, N m/A."""
    back_emf_constant: float
    """K_m, V s/rad."""
    resistance: float
    """R_m, ohm."""
    motor_inertia: float
    """J_1, kg m^2."""
    gear_inertia: float
    """J_2, kg m^2."""
    teeth: tuple[int, int, int]
    """N_1, N_2, N_3."""
    maximum_voltage: float | None
    """V; None for no limit."""


@dataclass(frozen=True, kw_only=True)
class EccentricSensor:
    """What is measured, how well and how often."""

    frame: Frame
    position_noise: float
    """Standard deviation, m."""
    velocity_noise: float
    """Standard deviation, m/s."""
    encoder_noise: float
    """Standard deviation, rad."""
    encoder_rate_noise: float
    """Standard deviation, rad/s."""
    step: float
    """Time between two samples, the step of the whole loop, s."""


@dataclass(frozen=True, kw_only=True)
class ImbalanceFilter:
    """The Kalman filter of rotor and unbalance."""

    step: float
    """s; a multiple of the sensor's."""
    discretisation: Discretisation
    position_noise: float
    """Standard deviation believed, m, above zero."""
    velocity_noise: float
    """Standard deviation believed, m/s, above zero."""
    velocity_walk: float
    """m/s within 1 s."""
    unbalance_walk: float
    """kg m within 1 s."""
    initial_position: float
    """Standard deviation, m."""
    initial_velocity: float
    """Standard deviation, m/s."""
    initial_unbalance: float
    """Standard deviation of each component, kg m."""
    gate: float
    """Relative standard deviation of the unbalance at which the estimate is taken."""
    assumed_mass: float
    """Rotor's mass as believed, without the driven masses, kg."""
    assumed_stiffness: float
    """N/m."""
    assumed_damping: float
    """N s/m."""


@dataclass(frozen=True, kw_only=True)
class FrictionFilter:
    """The extended Kalman filter of the friction arms, and the drive meanwhile."""

    step: float
    """s; a multiple of the sensor's."""
    discretisation: Discretisation
    rate_noise: float
    """Standard deviation believed, rad/s, above zero."""
    rate_walk: float
    """rad/s within 1 s."""
    friction_walk: float
    """m within 1 s."""
    initial_rate: float
    """Standard deviation, rad/s."""
    initial_friction: float
    """Standard deviation, m."""
    drive_speed: float
    """Of both masses along the track, rad/s."""
    speed_gain: float
    """gamma, V s/rad."""
    pair_gain: float
    """Voltage per error of the 180 degrees between the masses, V/rad."""
    stall_share: float
    """Share of `drive_speed` below which a warning is due."""
    gate: float
    """Relative standard deviation of the friction arm at which the estimate is taken."""


@dataclass(frozen=True, kw_only=True)
class Lqr:
    """The regulator that moves the masses to their targets."""

    state_weight: float
    """q; Q = q diag(0.1, 0.1, 0.01, 0.01) on rad and rad/s."""
    input_weight: float
    """r; R = r diag(0.1, 0.1) on N m."""
    step: float
    """Time for which a voltage is held, s; a multiple of the sensor's."""
    friction_compensation: FrictionCompensation


@dataclass(frozen=True, kw_only=True)
class FineTuning:
    """The search by trial."""

    step: float
    """First trial move, rad."""
    stop: float
    """Smallest trial move, rad."""
    wait: float
    """After a move, s."""
    average: float
    """Time of averaging, s."""


@dataclass(frozen=True, kw_only=True)
class Supervisor:
    """Order, gates and limits of the stages."""

    strategy: Strategy
    start: float
    """Beginning of the first stage, s."""
    limit: float
    """Amplitude below which no fine tuning is needed, zero-to-peak, m."""
    lowest_speed: float
    """Of the rotor, below which the imbalance is not estimated, rad/s."""
    arrival_angle: float
    """rad."""
    arrival_rate: float
    """rad/s."""
    imbalance_time: float
    """Longest, s."""
    friction_time: float
    """Longest, s."""
    positioning_time: float
    """Longest, s."""
    fine_tuning_time: float
    """Longest, s."""
    target_error: tuple[float, float]
    """Added to each target, rad."""


@dataclass(frozen=True, kw_only=True)
class EccentricScene:
    """All that a run with two driven masses needs, in SI units."""

    name: str
    rotor: EccentricRotor
    imbalance: Imbalance
    masses: DrivenMasses
    motor: Motor
    sensor: EccentricSensor
    imbalance_filter: ImbalanceFilter
    friction_filter: FrictionFilter
    lqr: Lqr
    fine_tuning: FineTuning
    supervisor: Supervisor
    run: RunSettings
    tolerance: float
    """Relative: bounds the discretisation in time."""
    source: str
    """File name without its folder; for messages and the evidence."""
    sha256: str
    """Of the scene file's bytes."""
    defaulted: tuple[str, ...] = ()
    """Paths such as "lqr.state_weight" whose value is a default, because the file does not give it."""

    @property
    def balancer(self) -> Literal["eccentric_mass"]:
        """Kind of balancer, as the scene file names it."""
        return "eccentric_mass"
