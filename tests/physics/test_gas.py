"""The gas supply compared with its mass balance as scipy solves it, and with numbers worked out by hand."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.gas import GasLine, compression_work, normal_volume, pressure_factor
from ringbalance.scene.models import Scene

AMBIENT = 101325.0
SUPPLY = 0.7e6 + AMBIENT
VOLUME = 51e-6
LINE = GasLine(
    supply_pressure=SUPPLY,
    ambient_pressure=AMBIENT,
    temperature=293.15,
    conductance=1e-8,
    critical_ratio=0.3,
    process="isothermal",
)


def rate(upstream: float, downstream: float, line: GasLine) -> float:
    """dp/dt of isothermal gas in `VOLUME`, from the mass flow of ISO 6358 without its laminar end."""
    b, ratio = line.critical_ratio, downstream / upstream
    shape = 1.0 if ratio <= b else math.sqrt(max(1 - ((ratio - b) / (1 - b)) ** 2, 0.0))
    mass_flow = line.conductance * upstream * 1.185 * math.sqrt(293.15 / line.temperature) * shape
    return mass_flow * (1e5 / 1.185 / 293.15) * line.temperature / VOLUME


@pytest.mark.parametrize("conductance", [0.2e-8, 0.5e-8, 1e-8])
@pytest.mark.parametrize("critical_ratio", [0.1, 0.3, 0.5, 0.7])
@pytest.mark.parametrize("temperature", [293.15, 330.0])
def test_filling_and_venting_follow_the_mass_balance(
    conductance: float, critical_ratio: float, temperature: float
) -> None:
    line = dataclasses.replace(
        LINE, conductance=conductance, critical_ratio=critical_ratio, temperature=temperature
    )
    for part in (0.2, 0.6, 0.95):
        end = AMBIENT + 0.7e6 * part
        known = solve_ivp(
            lambda p, _: [1 / rate(SUPPLY, p, line)], (AMBIENT, end), [0.0], rtol=1e-9, atol=1e-12
        )
        assert float(line.filling_time(end, volume=VOLUME)) == pytest.approx(known.y[0, -1], rel=1e-6)
        known = solve_ivp(
            lambda p, _: [-1 / rate(p, AMBIENT, line)], (SUPPLY, end), [0.0], rtol=1e-9, atol=1e-12
        )
        found = line.venting_time(SUPPLY, volume=VOLUME) - line.venting_time(end, volume=VOLUME)
        assert float(found) == pytest.approx(known.y[0, -1], rel=1e-6)
    whole = quad(lambda p: 1 / rate(p, AMBIENT, line), AMBIENT, AMBIENT / critical_ratio)[0]
    whole += quad(lambda p: 1 / rate(p, AMBIENT, line), AMBIENT / critical_ratio, SUPPLY)[0]
    assert float(line.venting_time(SUPPLY, volume=VOLUME)) == pytest.approx(whole, rel=1e-5)


@pytest.mark.parametrize(("conductance", "by_hand"), [(0.2e-8, 0.2228), (0.5e-8, 0.0891), (1e-8, 0.04455)])
def test_choked_to_the_end_filling_takes_its_lower_bound(conductance: float, by_hand: float) -> None:
    """51 ml x 0.7 MPa/(C x 801 325 Pa x 100 kPa); a line that is choked up to p_1 needs no longer."""
    line = dataclasses.replace(LINE, conductance=conductance)
    bound = line.choked_filling_time(volume=VOLUME)
    assert bound == pytest.approx(by_hand, rel=1e-3)
    choked = dataclasses.replace(line, critical_ratio=1 - 1e-9)
    assert float(choked.filling_time(SUPPLY, volume=VOLUME)) == pytest.approx(bound)
    assert bound < float(line.filling_time(SUPPLY, volume=VOLUME)) < 1.6 * bound


def test_a_line_needs_both_of_its_numbers(paper_scene: Scene) -> None:
    gas = dataclasses.replace(paper_scene.gas, conductance=None, critical_ratio=None)
    assert GasLine.of(gas) is None
    assert GasLine.of(dataclasses.replace(gas, conductance=1e-8)) is None
    own = GasLine.of(dataclasses.replace(gas, conductance=1e-8, critical_ratio=0.3))
    assert own is not None
    assert own.supply_pressure == gas.pressure + gas.ambient_pressure


def test_spinning_gas_is_in_hydrostatic_balance(paper_scene: Scene) -> None:
    """dp/dr = p omega^2 r/(R T), from the axis to the surface at equal fills, 40.0 mm at 10 000 rpm."""
    speed = 10000 * 2 * math.pi / 60
    surface = float(surface_radius(disc=paper_scene.disc, fill_ratio=0.25))
    known = solve_ivp(
        lambda r, p: p * speed**2 * r / (287.05 * 293.15), (0.0, surface), [1.0], rtol=1e-10, atol=1e-12
    )
    on_axis = dataclasses.replace(paper_scene.gas, measured_at="shaft")
    found = pressure_factor(dataclasses.replace(paper_scene, gas=on_axis))
    assert found == pytest.approx(known.y[0, -1], rel=1e-8)
    assert found - 1 == pytest.approx((speed * 0.040) ** 2 / (2 * 287.05 * 293.15), rel=2e-2)


def test_a_filling_costs_its_compression() -> None:
    """51 ml at 0.7 MPa gauge: 40.9 J ln 7.91 = 84.5 J and, at 20 degC, 0.376 normal litres."""
    content = SUPPLY * VOLUME
    assert compression_work(pressure_volume=content, pressure=SUPPLY, ambient_pressure=AMBIENT) == (
        pytest.approx(84.5, abs=0.05)
    )
    stages = np.geomspace(AMBIENT, SUPPLY, 20001)
    # Isothermal work of compression, minus that of the surroundings, plus what is pushed out.
    work = float(np.sum(np.diff(stages) * content / ((stages[1:] + stages[:-1]) / 2)))
    assert work == pytest.approx(84.5, abs=0.05)
    assert normal_volume(pressure_volume=content, temperature=293.15) == pytest.approx(0.3759e-3, rel=1e-3)
