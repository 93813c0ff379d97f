"""What following the paper's printed equations of the plant would do, one test for each doubt in the docs."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ringbalance.controller.eccentric_mass.integration import _PlantRun, run_plant
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, SpeedPoint, eccentric_scene
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.arrays import ComplexArray

RPM = math.pi / 30
SPEED = 100 * RPM
OPPOSITE = (0.0, math.pi)


@pytest.fixture(scope="module")
def scene() -> EccentricScene:
    return eccentric_scene(load_scene(bundled_scene("eccentric_mass_paper")))


@pytest.fixture(scope="module")
def p(scene: EccentricScene) -> PlantParameters:
    return PlantParameters.of(scene)


def test_k32_as_printed_misses_a_torque_as_large_as_friction(p: PlantParameters) -> None:
    """The matrix K: Omega^2 sin phi in place of -Omega^2 cos phi; at 100 rpm before balancing, phi = 0."""
    whirl = p.steady_whirl(SPEED, OPPOSITE)
    right = p.moment * SPEED**2 * (0.0 * whirl.real - 1.0 * whirl.imag)
    printed = p.moment * SPEED**2 * (0.0 * whirl.real + 0.0 * whirl.imag)
    friction = p.friction_arm_1 * p.moment * SPEED**2
    assert abs(printed - right) == pytest.approx(0.0248, abs=2e-4)
    assert friction == pytest.approx(0.0454, abs=1e-4)
    # At the worst angle the missing part is the whole pull of the whirl.
    worst = max(
        abs(whirl.imag * (math.sin(phi) + math.cos(phi))) * p.moment * SPEED**2
        for phi in np.linspace(0, 6.3, 400)
    )
    assert worst / friction == pytest.approx(0.773, abs=0.01)


def test_without_the_rate_terms_a_slow_run_up_hardly_changes(p: PlantParameters) -> None:
    """The peak of a locked run-up comes out 1.5 % too high at 4 rpm/s, and far more when it is fast."""

    def peak(slope: float, kept: float) -> float:
        rate = slope * RPM

        def rates(time: float, z: ComplexArray) -> ComplexArray:
            speed = 60 * RPM + rate * time
            force = p.unbalance * (speed**2 - 1j * kept * rate)
            damped = p.damping * (z[1] + 1j * speed * z[0]) + p.stiffness * z[0]
            turning = 2j * speed * z[1] + (1j * kept * rate - speed**2) * z[0]
            return np.array([z[1], (force - damped) / p.mass - turning])

        span = (0.0, 170 / slope)
        found = solve_ivp(rates, span, np.zeros(2, complex), rtol=1e-8, atol=1e-10, max_step=span[1] / 400)
        return float(np.abs(found.y[0]).max())

    assert peak(4.0, 0.0) / peak(4.0, 1.0) - 1 == pytest.approx(0.0148, abs=5e-4)
    assert abs(peak(100.0, 0.0) / peak(100.0, 1.0) - 1) > 0.05


def test_a_diagonal_c11_takes_the_free_whirl_away(p: PlantParameters) -> None:
    """Eq. (12) types 2 Omega M as diag: the transient no longer oscillates, and dies four times as fast."""
    stiffness = complex(p.stiffness - p.mass * SPEED**2, p.damping * SPEED)
    right = np.roots([p.mass, complex(p.damping, 2 * p.mass * SPEED), stiffness])
    printed = np.roots([p.mass, p.damping + 2 * p.mass * SPEED, stiffness])
    assert sorted(right.real) == pytest.approx([-p.damping / (2 * p.mass)] * 2, rel=0.05)
    assert np.abs(right.imag).min() > 2.9
    assert np.abs(printed.imag).max() < 1.5
    assert -printed.real.max() > 4 * -right.real.max()


def test_friction_by_the_angle_instead_of_the_rate(p: PlantParameters) -> None:
    """F-bar of section 3.5 has (Omega + phi)^2: at half a turn 69 % too much, after ten turns 48 times."""
    assert ((SPEED + math.pi) / SPEED) ** 2 == pytest.approx(1.69, abs=0.005)
    assert ((SPEED + 20 * math.pi) / SPEED) ** 2 > 48
    assert p.friction_arm_1 > 0


def test_mu_f_is_a_length(p: PlantParameters) -> None:
    """mu_f m_b r_b W^2 with a number for mu_f is a force; with mu_f r_b for it friction is 4.3 times less."""
    assert p.friction_arm_1 / (0.01 * 0.23) == pytest.approx(4.348, abs=1e-3)


def test_135_rpm_leaves_the_eccentric_masses_out(p: PlantParameters) -> None:
    """sqrt(K_B / m_r) is the paper's 135 rpm; with both masses on board it is 130.4 rpm."""
    assert math.sqrt(p.stiffness / 5.0) / RPM == pytest.approx(135.0, abs=0.1)
    assert math.sqrt(p.stiffness / p.mass) / RPM == pytest.approx(130.43, abs=0.01)


def test_the_imbalance_on_top_of_the_rotor(p: PlantParameters) -> None:
    """With m_im beside m_r the critical speed is 128.3 rpm, and the whirl at 100 rpm 4.7 % larger."""
    heavier = p._replace(mass=p.mass + 0.18)
    assert math.sqrt(p.stiffness / heavier.mass) / RPM == pytest.approx(128.3, abs=0.05)
    ratio = abs(heavier.steady_whirl(SPEED, OPPOSITE)) / abs(p.steady_whirl(SPEED, OPPOSITE))
    assert ratio == pytest.approx(1.047, abs=0.001)


def test_a_back_emf_of_the_wrong_sign_runs_away(p: PlantParameters) -> None:
    """Eq. (A9) lost its minus signs: with plus the speed of a mass grows e-fold every 0.07 s."""
    assert (p.inertia + p.drive_inertia) / p.drive_damping == pytest.approx(0.0701, abs=1e-4)


def test_gravity_would_be_nine_times_the_friction(p: PlantParameters) -> None:
    weight = p.moment * 9.80665
    assert weight / (p.friction_arm_1 * p.moment * SPEED**2) == pytest.approx(8.94, abs=0.01)


def test_the_normal_force_leaves_the_hub_out(p: PlantParameters) -> None:
    """The hub's own acceleration W^2 |z| changes the normal force by |z| / r_b, 4.6 % before balancing."""
    assert abs(p.steady_whirl(SPEED, OPPOSITE)) / 0.23 == pytest.approx(0.0464, abs=1e-4)


def balanced_angles(p: PlantParameters, error: float) -> tuple[float, float]:
    """Where both masses undo the imbalance, each moved by an error in the opposite sense."""
    half = math.acos(-p.unbalance / (2 * p.moment)) + error
    return p.phase + half, p.phase - half


def run_up(scene: EccentricScene, angles: tuple[float, float]) -> _PlantRun:
    """The paper's run-up from 100 rpm with the drives off; four times as fast, to be quick."""
    corners = (SpeedPoint(time=0.0, speed=SPEED), SpeedPoint(time=32.5, speed=230 * RPM))
    return run_plant(
        replace(
            scene,
            rotor=replace(scene.rotor, speed_profile=corners),
            masses=replace(scene.masses, initial_angle=angles),
            run=replace(scene.run, time_limit=32.5),
        )
    )


def test_friction_holds_a_balanced_rotor_through_its_critical_speed(
    scene: EccentricScene, p: PlantParameters
) -> None:
    """Period (D), drives off: masses at their targets stay there; 15 degrees off they are let go."""
    exact = run_up(scene, balanced_angles(p, 0.0))
    assert exact.amplitude.max() < 1e-12
    close = run_up(scene, balanced_angles(p, math.radians(3)))
    assert np.ptp(close.state[:, 4:6], axis=0).max() == 0.0
    assert close.amplitude.max() < 0.01
    loose = run_up(scene, balanced_angles(p, math.radians(15)))
    assert np.ptp(loose.state[:, 4]) > 1.0
    assert loose.amplitude.max() > 3 * close.amplitude.max()
    before = (2.0, 5.0)
    across = [abs((p.steady_whirl(rpm * RPM, before) * cmath.exp(-2j)).imag) for rpm in (60, 131, 1000)]
    margins = [p.friction_arm_1 - displacement for displacement in across]
    assert margins[0] > 0 > margins[1]
    assert margins[2] > 0


def test_lyapunov_bound_needs_the_whole_force(p: PlantParameters) -> None:
    """Appendix B: |q'| ends below the force over C_B; the whirl's own velocity does, and by how much."""
    force = p.unbalance * SPEED**2
    velocity = SPEED * abs(p.steady_whirl(SPEED, OPPOSITE))
    assert velocity < force / p.damping
    assert force / p.damping / velocity == pytest.approx(4.06, abs=0.02)
    assert cmath.phase(p.steady_whirl(SPEED, OPPOSITE)) < p.phase
