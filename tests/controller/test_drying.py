"""Water that dry gas takes from the chambers, against tables of handbooks and balances by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

import pytest

import ringbalance as rb
from ringbalance.controller.document import conventions
from ringbalance.physics.evaporation import carried_off, exhaust_cold
from ringbalance.scene.models import Scene

DENSITY = {0.0: 4.85e-3, 20.0: 17.3e-3, 40.0: 51.1e-3}
"""kg/m^3, of saturated vapour by temperature, degC: handbooks of moist air, such as ASHRAE's."""


def paper(**gas: object) -> Scene:
    scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
    return cast(Scene, scene.with_values({f"gas.{key}": value for key, value in gas.items()}))


@pytest.mark.parametrize(("celsius", "density"), DENSITY.items())
def test_gas_is_let_off_saturated(celsius: float, density: float) -> None:
    """A normal litre of dry gas swells by its temperature and by the vapour that comes to it."""
    warm = paper().with_values({"liquid.temperature": f"{celsius} degC"})
    kelvin = 273.15 + celsius
    vapour = density * 461.5 * kelvin
    swollen = kelvin / 273.15 * 101325.0 / (101325.0 - vapour)
    assert carried_off(warm) == pytest.approx(density * swollen, rel=0.005)


def test_the_loss_of_an_hour_is_that_of_its_gas() -> None:
    """38.9 normal litres an hour take 0.66 g by 17 g/m^3 of normal volume, of 67.7 g.  At 20 degC and ambient
    pressure the gas has 1.1 times that volume, and takes so much more."""
    each = carried_off(paper()) or 0.0
    assert 38.9e-3 * each == pytest.approx(1.10 * 0.66e-3, rel=0.02)
    run = rb.simulate(paper())
    rows = {row.key: row.value or 0.0 for row in conventions(run)}
    assert rows["liquid_per_hour"] == pytest.approx(each * rows["gas_per_hour"], rel=1e-12)
    assert rows["liquid_per_correction"] == pytest.approx(each * rows["gas_per_correction"], rel=1e-12)
    assert rows["liquid_part_per_hour"] == pytest.approx(rows["liquid_per_hour"] / 67.7e-3, rel=2e-3)


def test_humid_gas_takes_less() -> None:
    """Saturated in the supply it brings e/(p_1 - e) where it takes e/(p_a - e): an eighth at 0.7 MPa."""
    dry, half, full = (carried_off(paper(relative_humidity=each)) or 0.0 for each in (0, 0.5, 1))
    assert carried_off(paper()) == dry
    assert full / dry == pytest.approx(1 - (101325 - 2339) / (801325 - 2339), rel=1e-3)
    assert dry - half == pytest.approx((dry - full) / 2, rel=0.01)
    warmer = paper(relative_humidity=1, temperature="90 degC").with_values({"liquid.temperature": "5 degC"})
    assert carried_off(warmer) == 0.0


def test_of_oil_it_is_not_known() -> None:
    oil = {
        "liquid.name": "silicone oil 10 cSt",
        "liquid.temperature": "25 degC",
        "liquid.vapour_pressure": "0.4 kPa",
    }
    scene = paper().with_values(oil)
    assert carried_off(scene) is None
    assert "liquid_per_gas" not in rb.calibrate(scene).quantities
    rows = {row.key: row for row in conventions(rb.simulate(scene))}
    assert (rows["liquid_per_hour"].value, rows["liquid_per_hour"].status) == (None, "not_known")


def test_holding_ends_where_the_liquid_that_is_left_no_longer_cancels_the_unbalance() -> None:
    """With so much less liquid from the start, the disc comes just to the limit."""
    run = rb.simulate(paper())
    rows = {row.key: row.value or 0.0 for row in conventions(run)}
    lost = rows["liquid_part_per_hour"] * rows["holding_time"] / 3600.0
    assert 0.0 < lost < 0.5
    for part, reaches in ((0.98 * lost, True), (1.02 * lost, False)):
        less = replace(run.plant, total=(1 - part) * run.plant.total)
        assert (less.unreachable_vibration(rotor=run.scene.rotor) <= run.limit) == reaches
    calmer = rb.simulate(paper().with_values({"rotor.initial_vibration.amplitude": "9 um"}))
    longer = {row.key: row.value or 0.0 for row in conventions(calmer)}
    assert longer["liquid_part_per_hour"] * longer["holding_time"] / 3600.0 > lost + 0.03


def test_cold_of_the_exhaust_is_bounded_by_first_law_and_drag() -> None:
    """38.9 normal litres an hour: heat of gas let off at 20 degC by steps of a first-law balance, latent heat
    of 2.45 MJ/kg, and the outer wall's coefficient by Reynolds' analogy with the measured drag of rotating
    cylinders, 1/sqrt(C) = -0.6 + 4.07 log10(Re sqrt(C)).  The bound may be above by a third, not below."""
    cold = exhaust_cold(paper(), gas_per_hour=38.9e-3)
    assert cold is not None
    pressure, volume, constant, gamma = 801325.0, 1.0, 287.05, 1.4
    temperature, heat, steps = 293.15, 0.0, 20000
    step = (pressure - 101325.0) / steps
    for _ in range(steps):
        mass_out = step * volume / (constant * temperature)
        enthalpy = gamma / (gamma - 1) * constant * temperature * mass_out
        heat += enthalpy - step * volume / (gamma - 1)
    normal = (801325.0 - 101325.0) * volume / 101325.0 * 273.15 / temperature
    expected = 38.9e-3 / 3600 * (heat / normal + (carried_off(paper()) or 0.0) * 2.45e6)
    assert expected <= cold.power <= 1.02 * expected
    radius, width, omega = 44.5e-3, 62e-3, 10000 * math.pi / 30
    drag = 0.05
    for _ in range(50):
        drag = (-0.6 + 4.07 * math.log10(omega * radius**2 / 1.5e-5 * math.sqrt(drag))) ** -2
    coefficient = 1.22 * omega * radius * 1005 * drag / 2 * 0.71 ** (-2 / 3)
    drop = expected / (coefficient * 2 * math.pi * radius * width)
    assert drop <= cold.drop <= 4 / 3 * drop
    # Handbooks: 1.002 mPa s at 20 degC, 1.027 at 19.
    assert cold.viscosity == pytest.approx(cold.drop * math.log(1.027 / 1.002), rel=0.05)
    oil = {"liquid.name": "silicone oil 10 cSt", "liquid.temperature": "25 degC"}
    assert (
        exhaust_cold(paper().with_values({**oil, "liquid.vapour_pressure": "0.4 kPa"}), gas_per_hour=1.0)
        is None
    )
