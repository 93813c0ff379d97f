"""Quantities: exact factors, round trips, and refusals that say what to write instead."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ringbalance.scene.describe import setting_text
from ringbalance.scene.keys.declaration import keys_of
from ringbalance.scene.keys.fields import ValueReader
from ringbalance.scene.models import Gas
from ringbalance.scene.units import (
    DIMENSIONS,
    FieldError,
    format_quantity,
    parse_quantity,
    shortest_quantity,
)

EVERY_UNIT = [(dimension, unit) for dimension, kind in DIMENSIONS.items() for unit in kind.units]


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("44.5 mm", "length", 0.0445),
        ("4.45cm", "length", 0.0445),
        ("2.54e-2 m", "length", 0.0254),
        ("1 in", "length", 0.0254),
        ("1.5 µm", "length", 1.5e-6),
        ("1.5 μm", "length", 1.5e-6),
        ("90 deg", "angle", math.pi / 2),
        ("90°", "angle", math.pi / 2),
        ("−17 deg", "angle", -math.radians(17)),
        ("5 mrad", "angle", 0.005),
        ("1 g/ml", "density", 1000.0),
        ("1.89 g/cm³", "density", 1890.0),
        ("998.2 kg/m3", "density", 998.2),
        ("100 cSt", "kinematic_viscosity", 1e-4),
        ("1 mm^2/s", "kinematic_viscosity", 1e-6),
        ("1 mm2 / s", "kinematic_viscosity", 1e-6),
        ("0.7 MPa", "pressure", 7e5),
        ("7 bar", "pressure", 7e5),
        ("101.325 kPa", "pressure", 101325.0),
        ("20 degC", "temperature", 293.15),
        ("20 °C", "temperature", 293.15),
        ("68 degF", "temperature", 293.15),
        ("293.15 K", "temperature", 293.15),
        ("0.8 min", "time", 48.0),
        ("1 ms", "time", 1e-3),
        ("10000 rpm", "speed", 10000 * 2 * math.pi / 60),
        ("10000 r/min", "speed", 10000 * 2 * math.pi / 60),
        ("50 Hz", "speed", 100 * math.pi),
        ("0.0108 um/(g*mm)", "influence_coefficient", 0.0108),
        ("0.0108 um / (g mm)", "influence_coefficient", 0.0108),
        ("1 m/(kg*m)", "influence_coefficient", 1.0),
        ("1 um/(kg*m)", "influence_coefficient", 1e-6),
        ("0.08 s/um", "gain", 8e4),
        ("0.5 l/(s*bar)", "conductance", 5e-9),
        ("30 l/(min*bar)", "conductance", 5e-9),
        ("5 ml", "volume", 5e-6),
        ("9.80665 m/s^2", "acceleration", 9.80665),
        ("1 %", "share", 0.01),
    ],
)
def test_known_quantities(text: str, dimension: str, value: float) -> None:
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=2e-16)


@given(st.decimals(min_value="1e-3", max_value="1e3", places=6))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_one_rounding(number: object) -> None:
    """The product of decimal and factor is rounded once, so every unit gives the nearest double."""
    nearest = float(Fraction(str(number)) / 1000)
    assert parse_quantity(f"{number} mm", "length") == nearest
    assert parse_quantity(f"{number}e3 um", "length") == nearest
    assert parse_quantity(f"{number}e-3 m", "length") == nearest


@pytest.mark.parametrize(("dimension", "unit"), EVERY_UNIT)
@given(fraction=st.floats(1e-6, 0.99), sign=st.sampled_from([-1, 1]))
@settings(max_examples=20, deadline=None, derandomize=True)
def test_round_trip(dimension: str, unit: str, fraction: float, sign: int) -> None:
    """Written in any unit and read back, a value is itself to the digits written."""
    kind = DIMENSIONS[dimension]
    value = fraction * kind.largest * (1 if dimension == "temperature" else sign)
    written = format_quantity(value, dimension, unit, digits=17)
    offset = float(kind.units[unit].offset) * float(kind.units[unit].factor)
    assert parse_quantity(written, dimension) == pytest.approx(value, rel=1e-15, abs=1e-15 * offset)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_examples_are_quantities(dimension: str) -> None:
    kind = DIMENSIONS[dimension]
    assert kind.smallest < parse_quantity(kind.example, dimension) < kind.largest
    assert next(iter(kind.units.values())).factor == (Fraction(1, 100) if dimension == "share" else 1)


def test_no_unit_serves_two_dimensions() -> None:
    names = [unit for _, unit in EVERY_UNIT]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    ("value", "dimension", "problem"),
    [
        (44.5, "length", "a bare number has no unit"),
        (44, "length", "a bare number has no unit"),
        ("44.5", "length", "the unit is missing"),
        (True, "length", "not text with a number and a unit"),
        (["44.5 mm"], "length", "not text with a number and a unit"),
        ("", "length", "not a number followed by a unit"),
        ("mm", "length", "not a number followed by a unit"),
        ("1.2.3 mm", "length", "not a number followed by a unit"),
        ("44,5 mm", "length", "decimal comma"),
        ("1_000 mm", "length", "its digits are parted: write 1000"),
        ("10,000 rpm", "speed", "parted: write 10000 or, if the comma is a decimal one, 10.000"),
        ("10 000 rpm", "speed", "its digits are parted: write 10000"),
        ("10,000.5 rpm", "speed", "its digits are parted: write 10000.5"),
        ("1,234,567 rpm", "speed", "its digits are parted: write 1234567"),
        ("130 Nl/(min*bar)", "conductance", "101.325 kPa; 1 Nl is 1.087 l ANR"),
        ("nan mm", "length", "not a finite number"),
        ("-inf mm", "length", "not a finite number"),
        ("1e400 mm", "length", "magnitude is above 1000 m"),
        ("1e999999999 mm", "length", "magnitude is above 1000 m"),
        ("1e9 mm", "length", "magnitude is above 1000 m"),
        ("44.5 mm mm", "length", "is not a unit of length"),
        ("0.45 parsecs", "length", "is not a unit of length"),
        ("44.5 kPa", "length", "is a unit of pressure, not of length"),
        ("1 mPa*s", "kinematic_viscosity", "dynamic viscosity; divide by the density"),
        ("0.7 mPa", "pressure", 'did you mean "MPa"'),
        ("0.7 mpa", "pressure", 'did you mean "MPa"'),
        ("20 C", "temperature", "is not a unit of temperature"),
        ("-300 degC", "temperature", "absolute zero"),
        ("0 K", "temperature", "absolute zero"),
        ("1 mm" + " " * 80, "length", "longer than 60 characters"),
        ("1 m\x1b[31m", "length", "is not a unit of length"),
    ],
)
def test_refused(value: object, dimension: str, problem: str) -> None:
    with pytest.raises(FieldError) as caught:
        parse_quantity(value, dimension)
    assert problem in caught.value.problem
    assert caught.value.problem.isprintable()
    names = DIMENSIONS[dimension].units
    assert "absolute zero" in problem or all(name in caught.value.allowed for name in names)


@pytest.mark.parametrize(
    ("text", "dimension"),
    [("5 krpm", "speed"), ("3 grad", "angle"), ("3 Sl/(s*bar)", "conductance"), ("7 barx", "pressure")],
)
def test_no_unit_of_another_size_is_suggested(text: str, dimension: str) -> None:
    with pytest.raises(FieldError) as caught:
        parse_quantity(text, dimension)
    assert "did you mean" not in caught.value.problem


@pytest.mark.parametrize(
    ("key", "text", "pressure"),
    [
        ("pressure", "7 barg", 7e5),
        ("pressure", "0.7 MPa(g)", 7e5),
        ("pressure", "101 psig", 101 * 6894.757293168361),
        ("pressure", "7 bar", 7e5),
        ("ambient_pressure", "1 bara", 1e5),
        ("ambient_pressure", "100 kPa abs", 1e5),
    ],
)
def test_a_unit_may_say_how_its_pressure_is_counted(key: str, text: str, pressure: float) -> None:
    reader = keys_of(Gas)[key].takes
    assert isinstance(reader, ValueReader)
    assert reader.read(text) == pytest.approx(pressure)


@given(st.text(max_size=70))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_any_text_is_read_or_refused(text: str) -> None:
    problem = ""
    try:
        value = parse_quantity(text, "length")
    except FieldError as error:
        value, problem = 0.0, error.problem
    assert math.isfinite(value)
    assert problem.isprintable()


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        ("controller.integral_time", 48.0, "0.8 min"),
        ("controller.integral_time", 5.0, "5 s"),
        ("controller.derivative_time", 0.06, "0.06 s"),
        ("controller.limit", 1.375e-7, "0.1375 um"),
        ("liquid.temperature", 293.15, "20 degC"),
        ("disc.chambers", 6, "6"),
    ],
)
def test_a_setting_stands_in_minutes_where_these_are_round(path: str, value: float, text: str) -> None:
    assert setting_text(path, value) == text


@pytest.mark.parametrize(
    ("value", "text"), [(560000.0, "0.56 MPa"), (290000.0, "0.29 MPa"), (7e5, "0.7 MPa")]
)
def test_a_pressure_of_two_digits_is_written_with_two(value: float, text: str) -> None:
    """0.56 has no exact binary form; its sixteenth digit is none of the number's."""
    assert shortest_quantity(value, "MPa") == text
