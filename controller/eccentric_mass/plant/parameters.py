"""The plant's constants and its speed, gathered from a scene into plain numbers that compiled functions take.

With masses at rest on the track they give the steady whirl in closed form.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import NamedTuple

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, Motor
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import compiled


class PlantParameters(NamedTuple):
    """Constants of rotor, masses and motors, SI."""

    mass: float
    """M = m_r + 2 m_b, kg."""
    damping: float
    """C_B, N s/m."""
    stiffness: float
    """K_B, N/m."""
    unbalance: float
    """U = m_im r_im, kg m."""
    phase: float
    """phi_m of the unbalance in the rotor's frame, rad."""
    moment: float
    """b = m_b r_b of one eccentric mass, kg m."""
    inertia: float
    """J = m_b r_b^2 of one eccentric mass, kg m^2."""
    drive_inertia: float
    """Motor and gear B reflected to phi, kg m^2."""
    drive_damping: float
    """Back-emf reflected to phi, N m s."""
    drive_gain: float
    """Torque on a mass per motor voltage, N m/V."""
    friction_arm_1: float
    """mu_f of the first mass, m."""
    friction_arm_2: float
    """mu_f of the second mass, m."""
    gear_ratio: float
    """Turns of the motor per turn of the mass, N_3 / N_1."""
    back_emf_constant: float
    """K_m, V s/rad."""
    resistance: float
    """R_m, ohm."""
    maximum_voltage: float
    """V; infinite for no limit."""

    def influence(self, speed: float) -> complex:
        """Steady vibration per unbalance.

        alpha = W^2 / (K_B - M W^2 + j C_B W).
        Returns: m/(kg m), complex: the lag is minus its phase.
        Raises: ValueError: no damping, at the critical speed.
        """
        stiffness = complex(self.stiffness - self.mass * speed**2, self.damping * speed)
        if stiffness == 0:
            raise ValueError("a rotor without damping has no steady whirl at its critical speed")
        return speed**2 / stiffness

    def steady_whirl(self, speed: float, angles: Sequence[float]) -> complex:
        """Displacement x + j y in the rotor's frame at constant speed, masses at rest on the track.

        alpha (U exp(j phi_m) + b sum exp(j phi_i)).
        Returns: m, complex; its magnitude is the zero-to-peak vibration.
        Raises: ValueError: no damping, at the critical speed.
        """
        masses = sum(cmath.exp(1j * angle) for angle in angles)
        moment = self.unbalance * cmath.exp(1j * self.phase) + self.moment * masses
        return self.influence(speed) * moment

    @classmethod
    def of(cls, scene: EccentricScene) -> PlantParameters:
        """Gather the plant's constants.

        J_add = (J_1 + J_2 (N_1/N_2)^2) (N_3/N_1)^2, C_add = K_i K_m / R_m (N_3/N_1)^2,
        B_add = K_i / R_m N_3/N_1.
        Source: Appendix A of the paper on eccentric masses, rederived; its Eq. (A9) with all signs.
        """
        masses, rotor, imbalance, motor = scene.masses, scene.rotor, scene.imbalance, scene.motor
        ratio = motor.teeth[2] / motor.teeth[0]
        moment = masses.mass * masses.guide_radius
        return cls(
            mass=rotor.mass + 2 * masses.mass,
            damping=rotor.damping,
            stiffness=rotor.stiffness,
            unbalance=imbalance.mass * imbalance.radius,
            phase=imbalance.phase,
            moment=moment,
            inertia=moment * masses.guide_radius,
            drive_inertia=_reflected_inertia(motor),
            drive_damping=motor.torque_constant * motor.back_emf_constant / motor.resistance * ratio**2,
            drive_gain=motor.torque_constant / motor.resistance * ratio,
            friction_arm_1=masses.friction_arm[0],
            friction_arm_2=masses.friction_arm[1],
            gear_ratio=ratio,
            back_emf_constant=motor.back_emf_constant,
            resistance=motor.resistance,
            maximum_voltage=math.inf if motor.maximum_voltage is None else motor.maximum_voltage,
        )


def _reflected_inertia(motor: Motor) -> float:
    first, second, third = motor.teeth
    return (motor.motor_inertia + motor.gear_inertia * (first / second) ** 2) * (third / first) ** 2


@compiled
def speed_at(times: FloatArray, speeds: FloatArray, time: float) -> tuple[float, float]:
    """W, rad/s, and W', rad/s^2, just after a time; constant before the first corner and after the last."""
    if time < times[0]:
        return speeds[0], 0.0
    for place in range(len(times) - 1):
        if time < times[place + 1]:
            rate = (speeds[place + 1] - speeds[place]) / (times[place + 1] - times[place])
            return speeds[place] + rate * (time - times[place]), rate
    return speeds[-1], 0.0


@compiled
def turned(times: FloatArray, speeds: FloatArray, time: float) -> float:
    """Angle of the rotor, the integral of its speed from time zero. Returns: rad, not wrapped."""
    angle: float = speeds[0] * min(time, times[0])
    for place in range(len(times) - 1):
        end = min(time, times[place + 1])
        if end > times[place]:
            now, _ = speed_at(times, speeds, times[place])
            slope = (speeds[place + 1] - speeds[place]) / (times[place + 1] - times[place])
            length = end - times[place]
            angle += now * length + 0.5 * slope * length * length
    angle += speeds[-1] * max(0.0, time - times[-1])
    return angle
