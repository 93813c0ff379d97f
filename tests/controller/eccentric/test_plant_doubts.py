"""Consequences of the paper's printed equations of the plant, one test for each doubt in the docs."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from plant_runs import run_free

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint
from ringbalance.scene.arrays import FloatArray
from scenes import with_tables

RPM = math.pi / 30
SPEED = 100 * RPM
OPPOSITE = (0.0, math.pi)


def test_what_the_docs_state_of_the_printed_equations(parameters: PlantParameters) -> None:
    """Numbers of docs/eccentric-masses.md at 100 rpm, before balancing."""
    p = parameters
    whirl, pull = p.steady_whirl(SPEED, OPPOSITE), p.moment * SPEED**2
    friction, heavier = p.friction_arm[0] * pull, p._replace(mass=p.mass + 0.18)
    stated = {
        "K(3,2) misses a torque, at phi = 0": (pull * abs(whirl.imag), 0.0248, 2e-4),
        "friction torque": (friction, 0.0454, 1e-4),
        "(Omega + phi)^2 at half a turn": ((1 + math.pi / SPEED) ** 2, 1.69, 0.005),
        "(Omega + phi)^2 after ten turns": ((1 + 20 * math.pi / SPEED) ** 2, 49.0, 0.5),
        "mu_f r_b for a length": (p.friction_arm[0] / (0.01 * 0.23), 4.348, 1e-3),
        "critical speed by m_r alone": (math.sqrt(p.stiffness / 5.0) / RPM, 135.0, 0.1),
        "critical speed of the whole": (math.sqrt(p.stiffness / p.mass) / RPM, 130.43, 0.01),
        "critical speed with m_im beside m_r": (math.sqrt(p.stiffness / heavier.mass) / RPM, 128.3, 0.05),
        "its whirl": (abs(heavier.steady_whirl(SPEED, OPPOSITE) / whirl), 1.047, 1e-3),
        "e-fold by a back-EMF that drives": ((p.inertia + p.drive_inertia) / p.drive_damping, 0.0701, 1e-4),
        "weight along an upright track": (p.moment * 9.80665 / friction, 8.94, 0.01),
        "normal force of the hub's acceleration": (abs(whirl) / 0.23, 0.0464, 1e-4),
    }
    for doubt, (value, expected, within) in stated.items():
        assert value == pytest.approx(expected, abs=within), doubt


def test_a_diagonal_c11_takes_the_free_whirl_away(parameters: PlantParameters) -> None:
    """Eq. (12) types 2 Omega M as diag: the transient no longer oscillates, and dies four times as fast."""
    stiffness = complex(parameters.stiffness - parameters.mass * SPEED**2, parameters.damping * SPEED)
    right = np.roots([parameters.mass, complex(parameters.damping, 2 * parameters.mass * SPEED), stiffness])
    printed = np.roots([parameters.mass, parameters.damping + 2 * parameters.mass * SPEED, stiffness])
    assert sorted(right.real) == pytest.approx([-parameters.damping / (2 * parameters.mass)] * 2, rel=0.05)
    assert np.abs(right.imag).min() > 2.9
    assert np.abs(printed.imag).max() < 1.5
    assert -printed.real.max() > 4 * -right.real.max()


def balanced_angles(parameters: PlantParameters, error: float) -> tuple[float, float]:
    """Angles of both masses that undo the imbalance, each moved by an error in the opposite sense."""
    half = math.acos(-parameters.unbalance / (2 * parameters.moment)) + error
    return parameters.phase + half, parameters.phase - half


def run_up(scene: EccentricScene, angles: tuple[float, float]) -> FloatArray:
    """The paper's run-up from 100 rpm with the drives off; four times as fast, to be quick."""
    corners = (SpeedPoint(time=0.0, speed=SPEED), SpeedPoint(time=32.5, speed=230 * RPM))
    return run_free(
        with_tables(
            scene,
            rotor={"speed_profile": corners},
            masses={"initial_angle": angles},
            run={"time_limit": 32.5},
        )
    )


def whirl_of(states: FloatArray) -> float:
    """Largest displacement, m."""
    return float(np.hypot(states[:, 0], states[:, 1]).max())


def test_friction_holds_a_balanced_rotor_through_its_critical_speed(
    paper: EccentricScene, parameters: PlantParameters
) -> None:
    """Period (D), drives off: masses at their targets stay there; 15 degrees off they are let go."""
    exact = run_up(paper, balanced_angles(parameters, 0.0))
    assert whirl_of(exact) < 1e-12
    close = run_up(paper, balanced_angles(parameters, math.radians(3)))
    assert np.ptp(close[:, 4:6], axis=0).max() == 0.0
    assert whirl_of(close) < 0.01
    loose = run_up(paper, balanced_angles(parameters, math.radians(15)))
    assert np.ptp(loose[:, 4]) > 1.0
    assert whirl_of(loose) > 3 * whirl_of(close)
    before = (2.0, 5.0)
    across = [
        abs((parameters.steady_whirl(rpm * RPM, before) * cmath.exp(-2j)).imag) for rpm in (60, 131, 1000)
    ]
    margins = [parameters.friction_arm[0] - displacement for displacement in across]
    assert margins[0] > 0 > margins[1]
    assert margins[2] > 0


def test_lyapunov_bound_needs_the_whole_force(parameters: PlantParameters) -> None:
    """Appendix B: |q'| ends below the force over C_B; the whirl's own velocity does, and by how much."""
    force = parameters.unbalance * SPEED**2
    velocity = SPEED * abs(parameters.steady_whirl(SPEED, OPPOSITE))
    assert velocity < force / parameters.damping
    assert force / parameters.damping / velocity == pytest.approx(4.06, abs=0.02)
    assert cmath.phase(parameters.steady_whirl(SPEED, OPPOSITE)) < parameters.phase
