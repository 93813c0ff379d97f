"""Numbers of the standards against their printed forms and closed solutions."""

from __future__ import annotations

import math

import pytest

from ringbalance.physics import balancing
from ringbalance.scene.keys.derivations import permissible_unbalance


def test_permissible_unbalance_is_the_standards_9549_g_m_over_n() -> None:
    rpm = 3000.0
    permissible = permissible_unbalance(grade=2.5e-3, mass=40.0, speed=rpm * math.pi / 30)
    assert permissible == pytest.approx(1e-6 * 9549 * 2.5 * 40.0 / rpm, rel=1e-4)


def test_the_grade_of_a_permissible_unbalance_is_the_grade() -> None:
    turning = {"mass": 40.0, "speed": 300.0}
    permissible = permissible_unbalance(grade=2.5e-3, **turning)
    assert balancing.balance_grade(unbalance=permissible, **turning) == pytest.approx(2.5e-3)


def test_api_617_allows_four_ounce_inches_of_a_pound_and_a_turn_a_minute() -> None:
    """Energy-Tech's example: 500 lb on each journal, 15 000 rpm, 0.13 oz in for each plane."""
    ounce, inch = 28.349523125e-3, 25.4e-3
    allowed = balancing.api_617_unbalance(mass=1000 * 16 * ounce, speed=15_000 * math.pi / 30)
    assert allowed / 2 == pytest.approx(4 * 500 / 15_000 * ounce * inch, rel=1e-9)
    assert allowed / 2 == pytest.approx(0.13 * ounce * inch, rel=0.03)


def test_velocity_is_rms() -> None:
    assert balancing.rms_velocity(amplitude=1e-5, speed=100 * math.tau) == pytest.approx(4.443e-3, rel=1e-3)


@pytest.mark.parametrize(("peak", "zone"), [(2.0, "A"), (3.6, "B"), (4.9, "C"), (6.7, "D"), (math.inf, "D")])
def test_zones_follow_the_peak(peak: float, zone: str) -> None:
    assert balancing.zone(peak) == zone


def test_amplification_factor_is_the_half_power_one() -> None:
    """N_c/(N_2 - N_1) of API 617, between the speeds at which an unbalance gives 0.707 of the peak."""
    mass, stiffness, damping = 5.36, 1000.0, 10.0
    critical = balancing.critical_speed(mass=mass, stiffness=stiffness)
    speeds = [critical * (0.7 + 1e-5 * step) for step in range(60_000)]
    response = [w**2 / abs(complex(stiffness - mass * w**2, damping * w)) for w in speeds]
    half_power = max(response) / math.sqrt(2)
    wide = [w for w, each in zip(speeds, response, strict=True) if each >= half_power]
    factor = balancing.amplification_factor(mass=mass, stiffness=stiffness, damping=damping)
    assert factor == pytest.approx(critical / (wide[-1] - wide[0]), rel=0.03)
    assert balancing.amplification_factor(mass=mass, stiffness=stiffness, damping=0.0) is None
