"""The gas jet against numbers of gas tables, mass balances solved by scipy, and the relation of baths."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from ringbalance.physics.gas import flow_shape, flow_shapes, nozzle_flow
from ringbalance.physics.gas_jet import (
    DECAY,
    SURFACE_SHARE,
    Jet,
    _mach,
    _pitot,
    blowing_number,
    crater_depth,
    hole_flow,
    jet_of,
)

AMBIENT, TEMPERATURE = 101325.0, 293.15
SUPPLY = 0.526e6 + AMBIENT
RADIUS, SPEED, DENSITY = 37.7e-3, 10_000 * math.pi / 30, 998.2
GRAVITY = SPEED**2 * RADIUS
ESTIMATED_MM = {
    (0.2e-8, 0.3): (2.4, 0.14, 0.01),
    (0.39e-8, 0.3): (5.7, 0.5, 0.03),
    (1.1e-8, 0.28): (8.8, 4.0, 0.3),
    (2.3e-8, 0.36): (9.4, 7.3, 1.2),
}
"""Depth q/(rho omega^2 a) at holes of 2, 4 and 8 mm without contraction, by two estimates made apart from the
program, which agree within a factor of 1.4; by C and b of the valve."""


def area_of(diameter: float) -> float:
    return math.pi / 4 * diameter**2


def jet(
    diameter: float = 2e-3, line: tuple[float, float] | None = (1.1e-8, 0.28), chamber: float = AMBIENT
) -> Jet:
    conductance, ratio = line or (None, None)
    return jet_of(
        supply_pressure=SUPPLY,
        chamber_pressure=chamber,
        temperature=TEMPERATURE,
        area=area_of(diameter),
        conductance=conductance,
        critical_ratio=ratio,
    )


def depth(stream: Jet, distance: float, *, radius: float = RADIUS, speed: float = SPEED) -> float:
    return float(crater_depth(stream, distance=distance, surface_radius=radius, density=DENSITY, speed=speed))


@pytest.mark.parametrize("line", ESTIMATED_MM)
@pytest.mark.parametrize("hole", range(3))
def test_the_depth_at_the_hole_is_that_of_independent_estimates(line: tuple[float, float], hole: int) -> None:
    """A factor of 1.4, to which these agree; printed with one or two digits."""
    stream = jet((2e-3, 4e-3, 8e-3)[hole], line)
    estimated = ESTIMATED_MM[line][hole] * 1e-3
    assert 1 / 1.4 < float(stream.stagnation) / (DENSITY * GRAVITY) / estimated < 1.4
    # The pressure of the ring rises with the radius, so that its crater is shallower by n/(2 a).
    exact = depth(stream, 0.0)
    assert exact * (1 + exact / (2 * RADIUS)) == pytest.approx(float(stream.stagnation) / (DENSITY * GRAVITY))


@pytest.mark.parametrize("line", [*ESTIMATED_MM, (0.5e-8, 0.6)])
@pytest.mark.parametrize("diameter", [0.5e-3, 2e-3, 8e-3])
@pytest.mark.parametrize("chamber", [AMBIENT, 0.3e6, 0.6e6])
def test_valve_and_hole_pass_one_mass_flow(
    line: tuple[float, float], diameter: float, chamber: float
) -> None:
    def surplus(before: float) -> float:
        entering = (
            line[0] * 1e5 * math.sqrt(TEMPERATURE / 293.15) * SUPPLY * flow_shape(before / SUPPLY, line[1])
        )
        ratio = max(chamber / before, 0.528281788)
        shape = math.sqrt(7 * (ratio ** (2 / 1.4) - ratio ** (2.4 / 1.4)))
        return entering - area_of(diameter) * before * math.sqrt(287.05 * TEMPERATURE) * shape

    before = brentq(surplus, chamber, SUPPLY, xtol=1e-6)
    assert float(jet(diameter, line, chamber).pressure) == pytest.approx(before, rel=1e-6)


def test_a_choked_hole_passes_what_a_nozzle_does() -> None:
    flow = hole_flow(np.array(SUPPLY), np.array(AMBIENT), area=3e-6, temperature=TEMPERATURE)
    assert float(flow) == pytest.approx(nozzle_flow(pressure=SUPPLY, area=3e-6, temperature=TEMPERATURE))
    assert float(jet(line=None).pressure) == SUPPLY


def test_the_flow_shape_of_arrays_is_that_of_numbers() -> None:
    ratio = np.array([0.0, 0.2, 0.3, 0.5, 0.9, 0.9985, 0.9995, 1.0])
    for b in (0.0, 0.3, 0.7, 0.9995):
        assert flow_shapes(ratio, b).tolist() == pytest.approx([flow_shape(r, b) for r in ratio.tolist()])


@pytest.mark.parametrize(
    ("mach", "isentropic", "pitot"), [(1.0, 1.893, 1.893), (1.5, 3.671, 3.413), (2.0, 7.824, 5.640)]
)
def test_ratios_of_pressure_are_those_of_gas_tables(mach: float, isentropic: float, pitot: float) -> None:
    """NACA Report 1135, gamma = 1.4: p_t/p and p_t2/p."""
    assert float(_mach(np.array(isentropic))) == pytest.approx(mach, rel=1e-3)
    assert float(_pitot(np.array(mach))) == pytest.approx(pitot, rel=1e-3)


def test_a_slow_jet_has_the_momentum_of_its_velocity_and_a_core() -> None:
    slow = jet(8e-3, (0.2e-8, 0.3))
    # J = rho u^2 A = 2 q A to the order of q/p.
    assert float(slow.momentum) == pytest.approx(2 * float(slow.stagnation) * area_of(8e-3), rel=0.01)
    end = DECAY * 8e-3
    assert float(slow.at(0.98 * end, decay=DECAY)) == float(slow.stagnation)
    assert float(slow.at(2 * end, decay=DECAY)) == pytest.approx(float(slow.stagnation) / 4, rel=0.01)


@pytest.mark.parametrize("distance", [0.02, 0.05, 0.2])
def test_far_from_the_hole_a_flat_bath_has_the_relation_of_banks_and_chandrasekhara(distance: float) -> None:
    stream, radius = jet(4e-3, (0.2e-8, 0.3)), 1e4
    speed = math.sqrt(9.81 / radius)
    crater = depth(stream, distance, radius=radius, speed=speed)
    slope = crater / distance
    left = float(stream.momentum) / (DENSITY * 9.81 * distance**3)
    assert left == pytest.approx(math.pi / (2 * DECAY**2) * slope * (1 + slope) ** 2, rel=1e-4)


@pytest.mark.parametrize("diameter", [1e-3, 3e-3, 8e-3])
def test_a_crater_is_deepest_as_the_valve_opens(diameter: float) -> None:
    """Over the time in which a chamber fills, at the hole and away from it."""
    pressures = np.linspace(AMBIENT, SUPPLY, 60)
    streams = jet(diameter, chamber=pressures)  # type: ignore[arg-type]
    for distance in (0.0, 17e-3):
        depths = crater_depth(streams, distance=distance, surface_radius=RADIUS, density=DENSITY, speed=SPEED)
        assert np.all(np.diff(depths) <= 0)
        assert depths[-1] == pytest.approx(0.0, abs=1e-9)


def test_droplets_begin_where_waves_grow() -> None:
    """The least gas velocity at which gravity and surface tension do not hold a wave of any length."""
    tension, gas = 0.073, 1.2

    def held(wave: float) -> float:
        return (DENSITY * GRAVITY / wave + tension * wave) / gas

    square = float(minimize_scalar(lambda log: held(math.exp(log)), bounds=(5, 20), method="bounded").fun)
    pressure = gas * square / 2 / SURFACE_SHARE**2
    number = blowing_number(pressure, tension=tension, density=DENSITY, acceleration=GRAVITY)
    assert float(number) == pytest.approx(1.0, rel=1e-6)
