"""Numbers in the text of the pages with equations are what the program, or the page's own equation, gives."""

from __future__ import annotations

import cmath
import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from ringbalance.controller.eccentric_mass.drive_law import believed_whirl
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_scene
from ringbalance.physics.sloshing import resonant_fills, sloshing_response
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.verification.cases.driven_statements import limit_cycle, optimal, undisturbed

DOCS = Path(__file__).resolve().parents[1] / "docs"
RPM = math.pi / 30
FRICTION_ARM = 0.01


@cache
def words(page: str) -> str:
    return " ".join((DOCS / page).read_text(encoding="utf-8").split())


def agrees(page: str, pattern: str, *values: float) -> None:
    """The numbers that a passage prints are some values, to their last digit."""
    match = re.search(pattern, words(page))
    assert match is not None, pattern
    for text, value in zip(match.groups(), values, strict=True):
        half = 0.5 * 10.0 ** -len(text.partition(".")[2])
        assert abs(float(text) - value) <= 1.001 * half, (pattern, text, value)


@pytest.fixture(scope="module")
def rotor() -> EccentricScene:
    return eccentric_scene(load_scene(bundled_scene("eccentric_mass_paper")))


def stiffness(scene: EccentricScene, speed: float, *, more: float = 1.0, mass: float = 0.0) -> complex:
    """K_B - M W^2 + j C_B W, with the page's changes of stiffness and mass."""
    plant, w = PlantParameters.of(scene), speed * RPM
    return more * plant.stiffness - (plant.mass + mass) * w**2 + 1j * plant.damping * w


def whirl(scene: EccentricScene, speed: float) -> complex:
    """alpha: displacement per unbalance, 1/kg."""
    return (speed * RPM) ** 2 / stiffness(scene, speed)


def test_critical_speeds(rotor: EccentricScene) -> None:
    plant, page = PlantParameters.of(rotor), "eccentric-masses.md"
    speeds = np.linspace(125.0, 140.0, 15001)
    peak = speeds[np.argmax([abs(whirl(rotor, speed)) for speed in speeds])]
    bare, loaded, more = (
        math.sqrt(plant.stiffness / mass) / RPM
        for mass in (rotor.rotor.mass, plant.mass, plant.mass + rotor.imbalance.mass)
    )
    agrees(page, r"([\d.]+) rpm is \$\\sqrt\{K_B/m_r\}\$; with the masses it is ([\d.]+) rpm", bare, loaded)
    agrees(page, r"the steady whirl peaks at ([\d.]+) rpm", float(peak))
    larger = abs(stiffness(rotor, 100) / stiffness(rotor, 100, mass=rotor.imbalance.mass)) - 1
    agrees(page, r"critical speed ([\d.]+) rpm, whirl at 100 rpm ([\d.]+) % larger", more, 100 * larger)


def test_what_wrong_assumptions_do(rotor: EccentricScene) -> None:
    limits = [
        1e3 * float(believed_whirl(rotor).euler_step_limit(angular_velocity=speed * RPM))
        for speed in (100, 230)
    ]
    page = "eccentric-masses.md"
    agrees(page, r"`euler_step_limit`\): ([\d.]+) ms at 100 rpm, ([\d.]+) ms at 230 rpm", *limits)
    off = abs(stiffness(rotor, 100, more=1.1) / stiffness(rotor, 100)) - 1
    agrees(page, r"10 % on the stiffness is (\d+) % on the imbalance at 100 rpm", 100 * off)
    agrees(page, r"as a share of r_b, friction would be ([\d.]+) times less", 1 / rotor.masses.guide_radius)
    gravity = 9.81 / (FRICTION_ARM * (100 * RPM) ** 2)
    assert "nine times the friction at 100 rpm" in words(page)
    assert round(gravity) == 9


def test_where_friction_holds_the_masses(rotor: EccentricScene) -> None:
    plant, page = PlantParameters.of(rotor), "eccentric-masses.md"
    start = plant.unbalance * cmath.exp(1j * plant.phase)

    def held(speed: float) -> bool:
        return abs((whirl(rotor, speed) * start).imag) <= FRICTION_ARM

    agrees(page, r"held up to (\d+) rpm and again from (\d+) rpm on", 120, 230)
    agrees(page, r"between about (\d+) and (\d+) rpm the masses are let go", 125, 200)
    assert all(map(held, range(20, 121, 10)))
    assert not any(map(held, range(125, 201, 5)))
    assert held(230)
    peak = max(abs(whirl(rotor, speed)) for speed in np.linspace(100, 230, 2601))
    error = FRICTION_ARM / (peak * 2 * plant.moment * math.sin(math.pi / 3))
    agrees(page, r"below ([\d.]+) degrees the whole run-up stays below 10 mm", math.degrees(error))
    slow = math.sqrt(rotor.masses.guide_radius * 2 * RPM / FRICTION_ARM) / RPM
    agrees(page, r"(\d+) rpm for 2 rpm/s", slow)


def test_what_the_paper_on_eccentric_masses_only_states(rotor: EccentricScene) -> None:
    page = "eccentric-masses.md"
    still, cycle, law = (f(rotor, "light").numbers for f in (undisturbed, limit_cycle, optimal))
    lengths = [1e3 * still[name] for name in ("before", "least", "most", "least_unequal")]
    pattern = r"from ([\d.]+) mm to ([\d.]+) to ([\d.]+) mm with equal friction.*? falls to ([\d.]+) mm"
    agrees(page, pattern, *lengths)
    agrees(page, r"pair loop leaves ([\d.]+) %", 100 * still["paired"])
    swing = [1e3 * cycle[name] for name in ("least", "most", "locked")]
    agrees(page, r"([\d.]+) turns a minute: (\d+) to (\d+) mm, locked (\d+) mm", cycle["rate"], *swing)
    less = [100 * (1 - law[name]) for name in ("vibration", "energy")]
    pattern = r"([\d.]+) times its gain of the rate has (\d+) % less vibration and (\d+) % less energy"
    agrees(page, pattern, law["gain"], *less)


def test_waves_on_the_paper_s_disc(paper_scene: Scene) -> None:
    page, disc = "how-it-works.md", paper_scene.disc
    response = sloshing_response(
        disc=disc,
        fill_ratio=[0.25, 0.36, 0.38, 0.5],
        angular_velocity=paper_scene.rotor.speed,
        kinematic_viscosity=paper_scene.liquid.kinematic_viscosity,
        gravity=9.81,
    )
    moment, pressure = (
        np.abs(each.value) for each in (response.amplification, response.pressure_amplification)
    )
    agrees(page, r"on the paper's disc ([\d.]+) at equal fills", moment[0])
    low, high = response.amplification_interval[0]
    agrees(page, r"\(([\d.]+) to ([\d.]+) for natural frequencies", low, high)
    fullest = response.amplification_interval[3]
    agrees(page, r"anything from ([\d.]+) to (\d+) times", *fullest)
    assert moment[1] < 2 < moment[2]
    assert "2 from a fill of 0.37 up" in words(page)
    (third,) = [fill for mode, fill in resonant_fills(disc=disc) if mode == 3]
    agrees(page, r"with a peak at ([\d.]+), the third mode", third)
    swings = r"([\d.]+) times on the paper's disc at equal fills, where the moment swings ([\d.]+) times"
    agrees(page, swings, pressure[0], moment[0])
