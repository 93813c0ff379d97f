"""Known liquids against published values, and the refusal of temperatures without data."""

from __future__ import annotations

import csv
import hashlib
import math
from importlib import resources

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ringbalance.scene import known_liquids, liquid_at
from ringbalance.scene.units import FieldError


def _rows() -> list[dict[str, str]]:
    data = resources.files("ringbalance.scene") / "data" / "fluid_properties.csv"
    lines = data.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


@pytest.mark.parametrize("row", _rows(), ids=lambda row: f"{row['fluid']} {row['T_C']} degC")
def test_tabulated_temperatures(row: dict[str, str]) -> None:
    """At the table's own temperatures a liquid has the table's values, to the digits printed there."""
    liquid = liquid_at(name=row["fluid"], temperature=float(row["T_C"]) + 273.15)
    assert liquid.density == pytest.approx(float(row["rho_kg_m3"]), rel=1e-6)
    assert liquid.kinematic_viscosity == pytest.approx(float(row["nu_m2_s"]), rel=1e-5)
    assert liquid.vapour_pressure == pytest.approx(float(row["vapour_pressure_Pa"]), rel=5e-4)
    assert liquid.density_uncertainty == float(row["u95_rho_percent"]) / 100
    assert liquid.viscosity_uncertainty == float(row["u95_nu_percent"]) / 100


@pytest.mark.parametrize("row", _rows(), ids=lambda row: f"{row['fluid']} {row['T_C']} degC")
def test_table_is_consistent(row: dict[str, str]) -> None:
    """Kinematic viscosity is dynamic viscosity over density in every row."""
    assert float(row["nu_m2_s"]) == pytest.approx(float(row["mu_Pa_s"]) / float(row["rho_kg_m3"]), rel=6e-4)


@pytest.mark.parametrize(
    ("celsius", "density", "viscosity", "vapour_pressure"),
    [(20, 998.207, 1.0016e-3, 2339.3), (25, 997.047, 0.8900e-3, 3169.9), (60, 983.196, 0.4660e-3, 19946.0)],
)
def test_water_literature(celsius: float, density: float, viscosity: float, vapour_pressure: float) -> None:
    """Wagner and Pruss, J. Phys. Chem. Ref. Data 31 (2002) 387; Huber et al., ibid. 38 (2009) 101."""
    water = liquid_at(name="water", temperature=celsius + 273.15)
    assert water.density == pytest.approx(density, rel=2e-6)
    assert water.density * water.kinematic_viscosity == pytest.approx(viscosity, rel=2e-4)
    assert water.vapour_pressure == pytest.approx(vapour_pressure, rel=1e-4)


def test_the_series_of_water_is_the_one_that_was_made() -> None:
    text = (resources.files("ringbalance.scene") / "data" / "water.csv").read_text(encoding="utf-8")
    head, body = text.split("\n", 4)[:4], text.split("\n", 4)[4]
    assert head[3].endswith(hashlib.sha256(body.encode()).hexdigest())


@pytest.mark.parametrize("temperature", [273.0, 373.2, math.nan])
def test_water_is_liquid(temperature: float) -> None:
    with pytest.raises(FieldError, match="there are no data for water"):
        liquid_at(name="water", temperature=temperature)


def test_interpolation_of_viscosity() -> None:
    """Gallium at 35 degC: log(nu) linear in 1/T between 30 and 40 degC, density linear."""
    low, high, middle = 303.15, 313.15, 308.15
    weight = (1 / middle - 1 / low) / (1 / high - 1 / low)
    expected = math.exp((1 - weight) * math.log(2.7726e-7) + weight * math.log(2.6414e-7))
    liquid = liquid_at(name="gallium", temperature=middle)
    assert liquid.kinematic_viscosity == pytest.approx(expected, rel=1e-13)
    assert liquid.density == pytest.approx((6076.8 + 6070.7) / 2, rel=1e-13)
    assert liquid.viscosity_uncertainty == 0.135


@given(st.floats(303.15, 333.15))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_gallium_literature(temperature: float) -> None:
    """Assael et al., J. Phys. Chem. Ref. Data 41 (2012) 033101: log10(mu / mPa s) = -0.4465 + 204.03 K / T,

    rho / (kg/m^3) = 6077 - 0.611 (T - 302.914 K); the interpolated table lies 0.1 % and 0.01 % from them.
    """
    liquid = liquid_at(name="gallium", temperature=temperature)
    viscosity = 1e-3 * 10 ** (-0.4465 + 204.03 / temperature)
    assert liquid.density == pytest.approx(6077 - 0.611 * (temperature - 302.914), rel=1e-4)
    assert liquid.kinematic_viscosity * liquid.density == pytest.approx(viscosity, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("Water", "water"),
        (" silicone oil 100cSt ", "silicone oil 100 cSt"),
        ("Silicone-Oil 350 CST", "silicone oil 350 cSt"),
        ("silicone 50 cSt", "silicone oil 50 cSt"),
        ("KF-96L-5cs", "silicone oil 5 cSt"),
        ("Krytox GPL 101", "perfluorinated oil GPL 101"),
        ("GPL102", "perfluorinated oil GPL 102"),
        ("Gallium", "gallium"),
    ],
)
def test_names(name: str, found: str) -> None:
    known = {each.name: each for each in known_liquids()}
    assert liquid_at(name=name, temperature=known[found].temperatures[0]).name == found


def test_no_name_means_two_liquids() -> None:
    names = [name.casefold() for each in known_liquids() for name in (each.name, *each.aliases)]
    assert len(set(names)) == len(names)
    assert all(each.source for each in known_liquids())


@pytest.mark.parametrize(
    ("name", "celsius", "held"),
    [
        ("silicone oil 100 cSt", 20, "25 degC"),
        ("silicone oil 100 cSt", 25.02, "25 degC"),
        ("perfluorinated oil GPL 101", 25, "20 degC"),
        ("gallium", 29, "30 degC to 60 degC"),
        ("gallium", 60.1, "30 degC to 60 degC"),
        ("water", -5, "0 degC to 99.9 degC"),
        ("water", 100, "0 degC to 99.9 degC"),
    ],
)
def test_temperature_without_data(name: str, celsius: float, held: str) -> None:
    with pytest.raises(FieldError) as caught:
        liquid_at(name=name, temperature=celsius + 273.15)
    assert held in caught.value.allowed


def test_a_hundredth_of_a_kelvin_is_the_same_temperature() -> None:
    liquid = liquid_at(name="silicone oil 100 cSt", temperature=298.155)
    assert liquid.kinematic_viscosity == 1e-4
    assert liquid.temperature == 298.155


def test_unknown_name() -> None:
    with pytest.raises(FieldError) as caught:
        liquid_at(name="silicon oil 100 cst", temperature=298.15)
    assert 'did you mean "silicone oil 100 cSt"' in caught.value.problem
    assert all(liquid.name in caught.value.allowed for liquid in known_liquids())
