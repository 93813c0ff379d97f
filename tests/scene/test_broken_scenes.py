"""Scenes with one fault or several: each is named with table, key, value and what is allowed, no other is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import pytest

from ringbalance.scene import Scene, SceneError

Load = Callable[[Mapping[str, Any]], Scene]
REMOVED = object()


class Expected(NamedTuple):
    """What a fault must say."""

    table: str
    key: str
    value: str
    problem: str
    allowed: str


class Broken(NamedTuple):
    """Changes to the paper's scene by path, and the faults they make."""

    changes: Mapping[str, Any]
    faults: tuple[Expected, ...]


def _one(path: str, value: Any, problem: str, allowed: str, shown: str | None = None) -> Broken:
    table, _, key = path.rpartition(".")
    return Broken({path: value}, (Expected(table, key, shown or _shown(value), problem, allowed),))


def _shown(value: Any) -> str:
    if value is REMOVED:
        return "missing"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else str(value)


BEND = {"angle": "90 deg", "radius": "3 mm"}

SINGLE: dict[str, Broken] = {
    "unit of another kind": _one("disc.outer_radius", "44.5 kPa", "unit of pressure, not of length", "mm"),
    "unknown unit": _one("disc.axial_width", "62 furlongs", "not a unit of length", "44.5 mm"),
    "bare number": _one("disc.outer_radius", 44.5, "a bare number has no unit", '"44.5 mm"'),
    "boolean": _one("disc.outer_radius", True, "not text with a number and a unit", "mm"),
    "boolean as a number": _one("tube.extra_loss", True, "not a number", "a bare number of at least 0"),
    "boolean as a count": _one("disc.chambers", True, "not a whole number", "even whole number from 4 to 26"),
    "text as a number": _one("tube.drag_coefficient", "50", "it is text", "a bare number above 0"),
    "list as a quantity": _one("rotor.speed", ["1 rpm"], "not text with a number", "rpm", '["1 rpm"]'),
    "not a number": _one("disc.outer_radius", "nan mm", "not a finite number", "mm"),
    "infinite number": _one("tube.extra_loss", float("inf"), "not a finite number", "at least 0", "inf"),
    "huge": _one("disc.outer_radius", "1e300 mm", "above 1000 m", "mm"),
    "tiny": _one("disc.inner_radius", "1e-300 mm", "at least 1e-09 m", "above 0"),
    "negative radius": _one("disc.inner_radius", "-20.5 mm", "must be above 0", "a length above 0"),
    "zero width": _one("disc.axial_width", "0 mm", "must be above 0", "a length above 0"),
    "negative plate": _one("disc.plate_thickness", "-1 mm", "must be at least 0", "length of at least 0"),
    "inner beyond outer": _one(
        "disc.inner_radius", "45 mm", "smaller than outer_radius (44.5 mm)", "below 44.5 mm"
    ),
    "inner equals outer": _one("disc.inner_radius", "44.5 mm", "smaller than outer_radius", "below 44.5 mm"),
    "plates close the chamber": _one("disc.plate_thickness", "15 mm", "close the chamber", "14.4957 mm"),
    "odd chambers": _one("disc.chambers", 3, "must be even", "even whole number from 4 to 26"),
    "two chambers": _one("disc.chambers", 2, "correct along one line only", "from 4 to 26"),
    "no chambers": _one("disc.chambers", 0, "must lie from 4 to 26", "even whole number"),
    "half a chamber": _one("disc.chambers", 4.5, "not a whole number", "even whole number"),
    "chambers that overlap": Broken(
        {"disc.central_angle": "91 deg"},
        (Expected("disc", "central_angle", '"91 deg"', "4 chambers of this angle do not fit", "90 deg"),),
    ),
    "angle that makes an odd number": Broken(
        {"disc.central_angle": "72 deg", "disc.chambers": REMOVED, "controller.sequence": REMOVED},
        (Expected("disc", "central_angle", '"72 deg"', "= 5 is not an even number", "60 deg"),),
    ),
    "fill beyond one": _one("disc.initial_fill", 1.2, "at most 1", "a share above 0 and at most 1"),
    "fill of zero": Broken(
        {"disc.max_fill_ratio": 0}, (Expected("disc", "max_fill_ratio", "0", "above 0", "at most 1"),)
    ),
    "fill that is not half": _one("disc.initial_fill", 0.3, "add up to max_fill_ratio (0.5)", "0.25"),
    "no time to hold": _one("controller.hold_time", "0 s", "must be above 0", "a time above 0"),
    "place of the gauge": _one(
        "gas.measured_at", "valve", "not one of the known words", '"chamber" or "shaft"'
    ),
    "shape of the crest": _one("tube.hump_shape", "arch", 'did you mean "arc"', '"arc" or "point"'),
    "dissolved gas": _one("liquid.dissolved_gas", True, "it is not text", '"none" or "saturated"'),
    "unknown liquid": _one("liquid.name", "watr", 'did you mean "water"', "gallium"),
    "temperature without data": _one(
        "liquid.temperature", "120 degC", "no data for water", "0 degC to 99.9 degC"
    ),
    "temperature missing": _one(
        "liquid.temperature", REMOVED, "depend on it", "water at 0 degC to 99.9 degC"
    ),
    "viscosity of zero": _one("liquid.kinematic_viscosity", "0 cSt", "above 0", "cSt"),
    "dynamic viscosity": _one("liquid.kinematic_viscosity", "1 mPa*s", "dynamic viscosity", "mm^2/s"),
    "boiling": _one("liquid.vapour_pressure", "2 bar", "boils", "below 101.325 kPa"),
    "boiling in a vacuum": Broken(
        {"gas.ambient_pressure": "1 kPa"},
        (Expected("liquid", "temperature", '"20 degC"', "boils: its vapour pressure at", "(1 kPa)"),),
    ),
    "port beyond the wall": _one(
        "tube.port_radius", "45 mm", "port lies outside", "at most outer_radius (44.5 mm)"
    ),
    "port inside the chamber's floor": _one(
        "tube.port_radius", "20 mm", "port lies outside", "inner_radius (20.5 mm)"
    ),
    "siphon crest outside the port": Broken(
        {"tube.port_radius": "41 mm", "tube.hump_radius": "42 mm"},
        (Expected("tube", "hump_radius", '"42 mm"', "lies outside the port", "below port_radius (41 mm)"),),
    ),
    "siphon crest outside the disc": _one(
        "tube.hump_radius", "50 mm", "outer wall too", "at most outer_radius (44.5 mm)"
    ),
    "siphon crest on the axis": _one("tube.hump_radius", "0 mm", "above 0", "a length above 0"),
    "siphon crest at the end": _one("tube.hump_position", 1, "below 1", "above 0 and below 1"),
    "bore too wide for the bends": _one(
        "tube.bore", "6.5 mm", "tightest of the bends", "at most twice that radius, 6 mm"
    ),
    "bore too wide for the chamber": Broken(
        {"tube.bore": "70 mm", "tube.bends": REMOVED},
        (Expected("tube", "bore", '"70 mm"', "no wall of the chamber", "at most 62 mm"),),
    ),
    "tube too short for its bends": Broken(
        {"tube.bends": [{"angle": "90 deg", "radius": "80 mm"}]},
        (Expected("tube", "length", '"120 mm"', "shorter than the arcs", "at least 125.664 mm"),),
    ),
    "tube too short for the siphon crest": _one(
        "tube.length", "60 mm", "cannot reach the opposite port over the siphon crest", "62.93"
    ),
    "tube too short to cross": Broken(
        {"tube.length": "60 mm", "tube.hump_radius": REMOVED},
        (Expected("tube", "length", '"60 mm"', "cannot reach the opposite port", "62.93"),),
    ),
    "length missing": _one("tube.length", REMOVED, "k cannot be calculated", "a length above 0"),
    "rough as the bore": _one("tube.roughness", "1 mm", "closes the tube", "bore / 2 = 0.75 mm"),
    "unknown entrance": _one("tube.entrance", "rouned", 'did you mean "rounded"', '"sharp" or "rounded"'),
    "rounded entrance without radius": Broken(
        {"tube.entrance": "rounded"},
        (Expected("tube", "entrance_radius", "missing", "needs its radius", "a length above 0"),),
    ),
    "sharp entrance with radius": _one(
        "tube.entrance_radius", "1 mm", "a sharp entrance has no radius", "rounded"
    ),
    "bends that are no list": _one("tube.bends", "90 deg", "it is not a list", "radius"),
    "bend with a typo": Broken(
        {"tube.bends": [BEND, {"angle": "90 deg", "radios": "3 mm"}]},
        (Expected("tube", "bends[2].radios", '"3 mm"', 'did you mean "radius"', "angle, radius"),),
    ),
    "negative drag": _one("tube.drag_coefficient", -50, "above 0", "a bare number above 0"),
    "pressure below zero": _one("gas.pressure", "-0.7 MPa", "at least 0", "a pressure of at least 0"),
    "no surroundings": _one("gas.ambient_pressure", "0 Pa", "above 0", "a pressure above 0"),
    "conductance alone": Broken(
        {"gas.conductance": "0.5 l/(s*bar)"},
        (Expected("gas", "critical_ratio", "missing", "conductance has no meaning", "above 0 and below 1"),),
    ),
    "critical ratio alone": Broken(
        {"gas.critical_ratio": 0.3},
        (Expected("gas", "conductance", "missing", "critical_ratio has no meaning", "l/(s*bar)"),),
    ),
    "shaft askew": _one(
        "environment.shaft", "tilted", "not one of the known words", '"horizontal" or "vertical"'
    ),
    "negative gravity": _one("environment.gravity", "-9.81 m/s^2", "at least 0", "m/s^2"),
    "standing still": _one("rotor.speed", "0 rpm", "above 0", "rpm"),
    "influence of a length": _one("rotor.influence_coefficient", "1 um", "unit of length", "um/(g*mm)"),
    "vibration without phase": Broken(
        {"rotor.initial_vibration": {"amplitude": "10 um"}},
        (Expected("rotor", "initial_vibration.phase", "missing", "needed", "an angle"),),
    ),
    "vibration that is no table": _one("rotor.initial_vibration", "10 um", "not a table", "amplitude, phase"),
    "negative noise": _one("sensor.amplitude_noise", "-1 um", "at least 0", "a length of at least 0"),
    "unknown algorithm": _one("controller.kind", "pid", "not one of the known words", '"law_based"'),
    "limit in the noise": _one("controller.limit", "0.01 um", "is below the sensor noise", "above 0.01 um"),
    "gain of zero": _one("controller.proportional", "0 s/um", "above 0", "s/um"),
    "gain upside down": _one(
        "controller.proportional", "0.08 um/s", "a unit of velocity, not of gain", "s/um"
    ),
    "integral time below zero": _one("controller.integral_time", "-1 s", "above 0", "a time above 0"),
    "valve-open times crossed": _one(
        "controller.minimum_gas_time", "6 s", "shorter than maximum_gas_time (5 s)", "below 5 s"
    ),
    "valve slower than the period": Broken(
        {"gas.valve_lag": "0.6 s"},
        (Expected("controller", "period", '"0.5 s"', "before the valve has moved", "at least 0.6 s"),),
    ),
    "letter twice": _one(
        "controller.sequence", ["A", "A", "B", "C"], "more than once", "each once", '["A", "A", "B", "C"]'
    ),
    "letter missing": _one(
        "controller.sequence", ["A", "C", "B"], "each of the 4 chambers", "A, B, C, D", '["A", "C", "B"]'
    ),
    "letter unknown": _one(
        "controller.sequence", ["a", "C", "B", "D"], "capital letter", "each once", '["a", "C", "B", "D"]'
    ),
    "trial step never executed": Broken(
        {"controller.kind": "trial", "controller.short_step": "0.5 ms"},
        (Expected("controller", "short_step", '"0.5 ms"', "never executed", "minimum_gas_time (0.001 s)"),),
    ),
    "trial steps crossed": Broken(
        {"controller.kind": "trial", "controller.short_step": "300 ms"},
        (Expected("controller", "short_step", '"300 ms"', "longer than long_step", "at most 0.1 s"),),
    ),
    "spread of something unknown": _one("uncertainty.colour", "5 %", "unknown key", "lag_angle"),
    "spread of something absent": _one(
        "uncertainty.drag_coefficient", "5 %", "has no drag_coefficient", "[tube]"
    ),
    "spread beyond the value": _one("uncertainty.bore", "2 mm", "larger than bore itself", "below 100 %"),
    "spread of all": _one("uncertainty.bore", "100 %", "below 100 %", '"5 %"'),
    "spread without unit": _one("uncertainty.bore", 0.1, "a bare number has no unit", '"5 %"'),
    "negative seed": _one("run.seed", -1, "from 0 to 2^63 - 1", "whole number"),
    "huge seed": _one("run.seed", 2**63, "from 0 to 2^63 - 1", "whole number"),
    "tolerance of one": _one("accuracy.tolerance", 1, "below 1", '"1 %"'),
    "tolerance of zero": _one("accuracy.tolerance", "0 %", "above 0", '"1 %"'),
    "empty name": _one("name", "", "empty, too long or not printable", "text on one line"),
    "number as a name": _one("name", 7, "not text", "text on one line"),
    "unknown balancer": _one("balancer", "liquid_rings", 'did you mean "liquid_ring"', '"liquid_ring"'),
    "needed key missing": _one("disc.axial_width", REMOVED, "every scene needs it", "a length above 0"),
    "needed pressure missing": _one("gas.pressure", REMOVED, "every scene needs it", "a pressure"),
    "misspelt key": Broken(
        {"disc.outer_radius": REMOVED, "disc.outer_radus": "44.5 mm"},
        (
            Expected(
                "disc",
                "outer_radus",
                '"44.5 mm"',
                'did you mean "outer_radius"',
                "outer_radius, inner_radius",
            ),
        ),
    ),
    "key in the wrong table": Broken(
        {"tube.bore": REMOVED, "disc.bore": "1.5 mm"},
        (Expected("disc", "bore", '"1.5 mm"', "it belongs in [tube]", "outer_radius"),),
    ),
    "key outside its table": Broken(
        {"rotor.speed": REMOVED, "speed": "10000 rpm"},
        (Expected("", "speed", '"10000 rpm"', "it belongs in [rotor]", "name, balancer, disc"),),
    ),
    "name in a table": Broken(
        {"name": REMOVED, "disc.name": "x"},
        (Expected("disc", "name", '"x"', "it belongs at the top", "outer_radius"),),
    ),
    "table that is a number": Broken(
        {"disc": 5}, (Expected("disc", "", "5", "not a table", "a table with outer_radius"),)
    ),
    "table that is missing": Broken(
        {"rotor": REMOVED}, (Expected("rotor", "", "missing", "every scene needs this table", "speed"),)
    ),
    "liquid that is missing": Broken(
        {"liquid": REMOVED}, (Expected("liquid", "", "missing", "needs this table", "kinematic_viscosity"),)
    ),
    "liquid without a name": Broken(
        {"liquid": {"temperature": "20 degC"}},
        (Expected("liquid", "name", "missing", "not named", "density and kinematic_viscosity"),),
    ),
    "custom liquid without viscosity": Broken(
        {"liquid": {"density": "800 kg/m^3"}},
        (Expected("liquid", "kinematic_viscosity", "missing", "needed for a liquid without", "cSt"),),
    ),
    "oil at another temperature": Broken(
        {"liquid": {"name": "silicone oil 100 cSt", "temperature": "20 degC"}},
        (Expected("liquid", "temperature", '"20 degC"', "no data for silicone oil 100 cSt", "at 25 degC"),),
    ),
    "misspelt table": Broken(
        {"accuracy": REMOVED, "acuracy": {"tolerance": "1 %"}},
        (Expected("acuracy", "", "", 'did you mean "accuracy"', "disc, liquid"),),
    ),
    "table of another program": Broken(
        {"mass": {"value": 1}}, (Expected("mass", "", "", "unknown table", "disc, liquid"),)
    ),
}

SEVERAL: dict[str, Broken] = {
    "schema and cross-check together": Broken(
        {"disc.axial_width": "62 kg", "tube.hump_radius": "50 mm", "controller.limit": "0.005 um"},
        (
            Expected("disc", "axial_width", '"62 kg"', "a unit of mass, not of length", "mm"),
            Expected("tube", "hump_radius", '"50 mm"', "siphon crest lies outside", "44.5 mm"),
            Expected("controller", "limit", '"0.005 um"', "is below the sensor noise", "above 0.01 um"),
        ),
    ),
    "everywhere": Broken(
        {
            "disc.inner_radius": "50 mm",
            "disc.chambers": 5,
            "disc.initial_fill": 1.5,
            "liquid.name": "mercury",
            "tube.bore": "-1 mm",
            "gas.pressure": "-1 bar",
            "rotor.speeed": "3 rpm",
            "accuracy.tolerance": 2,
        },
        (
            Expected("disc", "inner_radius", '"50 mm"', "smaller than outer_radius", "below 44.5 mm"),
            Expected("disc", "chambers", "5", "must be even", "even"),
            Expected("disc", "initial_fill", "1.5", "at most 1", "at most 1"),
            Expected("liquid", "name", '"mercury"', "no liquid of that name", "water"),
            Expected("tube", "bore", '"-1 mm"', "above 0", "above 0"),
            Expected("gas", "pressure", '"-1 bar"', "at least 0", "at least 0"),
            Expected("rotor", "speeed", '"3 rpm"', 'did you mean "speed"', "speed"),
            Expected("accuracy", "tolerance", "2", "below 1", "below 1"),
        ),
    ),
    "two rules for one radius": Broken(
        {"disc.inner_radius": "45 mm", "disc.plate_thickness": "35 mm"},
        (
            Expected("disc", "inner_radius", '"45 mm"', "smaller than outer_radius", "below 44.5 mm"),
            Expected("disc", "plate_thickness", '"35 mm"', "close the chamber", "31.8198 mm"),
        ),
    ),
    "a spread needs no value that is missing anyway": Broken(
        {"tube.length": REMOVED, "uncertainty": {"length": "1 mm"}},
        (Expected("tube", "length", "missing", "k cannot be calculated", "a length above 0"),),
    ),
    "all tables missing": Broken(
        dict.fromkeys(("disc", "liquid", "tube", "gas", "rotor"), REMOVED),
        tuple(
            Expected(table, "", "missing", "every scene needs this table", key)
            for table, key in {
                "disc": "outer_radius",
                "liquid": "density",
                "tube": "bore",
                "gas": "pressure",
                "rotor": "speed",
            }.items()
        ),
    ),
    "a misspelt key hides no other fault": Broken(
        {"tube.hump_radus": "31 mm", "tube.hump_radius": REMOVED, "tube.roughness": "-1 um"},
        (
            Expected("tube", "roughness", '"-1 um"', "at least 0", "of at least 0"),
            Expected("tube", "hump_radus", '"31 mm"', 'did you mean "hump_radius"', "hump_radius"),
        ),
    ),
    "three steps of the trial algorithm": Broken(
        {"controller.kind": "trial", "controller.maximum_gas_time": "3 ms"},
        tuple(
            Expected("controller", key, value, "never executed", "maximum_gas_time (0.003 s)")
            for key, value in {
                "first_trial": '"50 ms"',
                "long_step": '"100 ms"',
                "short_step": '"5 ms"',
            }.items()
        ),
    ),
}


def _changed(document: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    for path, value in changes.items():
        table, _, key = path.rpartition(".")
        content = document.setdefault(table, {}) if table else document
        if value is REMOVED:
            content.pop(key)
        else:
            content[key] = value
    return document


@pytest.mark.parametrize("broken", [*SINGLE.values(), *SEVERAL.values()], ids=[*SINGLE, *SEVERAL])
def test_every_fault_is_named(broken: Broken, paper_document: dict[str, Any], load: Load) -> None:
    """The faults are the expected ones, in the order of the file's reference, and there is no other."""
    with pytest.raises(SceneError) as caught:
        load(_changed(paper_document, broken.changes))
    faults = caught.value.faults
    assert [(fault.table, fault.key, fault.value) for fault in faults] == [
        (expected.table, expected.key, expected.value) for expected in broken.faults
    ]
    for fault, expected in zip(faults, broken.faults, strict=True):
        assert expected.problem in fault.problem
        assert expected.allowed in fault.allowed
        assert fault.file.endswith("my_disc.toml")


@pytest.mark.parametrize("broken", [*SINGLE.values(), *SEVERAL.values()], ids=[*SINGLE, *SEVERAL])
def test_message_is_a_line_for_each_fault(broken: Broken, paper_document: dict[str, Any], load: Load) -> None:
    with pytest.raises(SceneError) as caught:
        load(_changed(paper_document, broken.changes))
    lines = str(caught.value).splitlines()
    assert len(lines) == len(broken.faults)
    for line, expected in zip(lines, broken.faults, strict=True):
        assert line.isprintable()
        assert "my_disc.toml: " in line
        assert (f"[{expected.table}]" if expected.table else "") in line
        assert expected.key in line
        assert "; allowed: " in line


def test_the_line_reads_as_a_sentence(paper_document: dict[str, Any], load: Load) -> None:
    with pytest.raises(SceneError) as caught:
        load(_changed(paper_document, {"disc.inner_radius": "50 mm"}))
    assert str(caught.value).endswith(
        'my_disc.toml: [disc] inner_radius = "50 mm": the inner radius must be smaller than outer_radius '
        "(44.5 mm); allowed: above 0 mm and below 44.5 mm"
    )
