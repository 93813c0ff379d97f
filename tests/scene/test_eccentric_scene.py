"""Scenes with two eccentric masses: values, defaults, every fault by name, and the way to each kind."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ringbalance as rb
from ringbalance.controller.eccentric_mass import control_records, scene_records
from ringbalance.controller.eccentric_mass.scene_records import (
    ECCENTRIC_MASS,
    EccentricScene,
    eccentric_scene,
)
from ringbalance.scene import (
    AnyScene,
    Scene,
    SceneError,
    bundled_scene,
    liquid_ring_scene,
    load_scene,
    scene_from,
)
from ringbalance.scene.keys.schema import ORIGIN
from ringbalance.scene.loop_models import RunSettings

RPM = math.pi / 30
TABLES = tuple(ECCENTRIC_MASS.tables)
Load = Callable[[Mapping[str, Any]], Any]
RECORDS = {
    "rotor": scene_records.EccentricRotor,
    "imbalance": scene_records.Imbalance,
    "masses": scene_records.EccentricMasses,
    "motor": scene_records.Motor,
    "sensor": scene_records.EccentricSensor,
    "imbalance_filter": control_records.ImbalanceFilter,
    "friction_filter": control_records.FrictionFilter,
    "lqr": control_records.Lqr,
    "fine_tuning": control_records.FineTuning,
    "supervisor": control_records.Supervisor,
    "run": RunSettings,
}


def _keys(table: str) -> set[str]:
    return set(ECCENTRIC_MASS.tables[table].keys) - {ORIGIN}


@pytest.fixture
def driven_document() -> dict[str, Any]:
    """The paper's scene, to be changed at will."""
    return tomllib.loads(bundled_scene("eccentric_mass_paper").read_text(encoding="utf-8"))


@pytest.fixture
def least_document(driven_document: dict[str, Any]) -> dict[str, Any]:
    """The least that such a scene needs."""
    needed = {
        "rotor": ("mass", "stiffness", "damping", "speed_profile"),
        "imbalance": ("mass", "radius", "phase"),
        "masses": ("mass", "guide_radius", "arc_length"),
        "motor": tuple(driven_document["motor"]),
    }
    tables = {table: {key: driven_document[table][key] for key in keys} for table, keys in needed.items()}
    return {"balancer": "eccentric_mass", **tables}


def test_the_papers_scene_has_the_papers_values() -> None:
    """Table 1, the speeds of Fig. 9 and q/r of section 4 of the paper on eccentric masses."""
    scene = load_scene(bundled_scene("eccentric_mass_paper"))
    assert isinstance(scene, EccentricScene)
    rotor, masses = scene.rotor, scene.masses
    assert (rotor.mass, rotor.stiffness, rotor.damping) == (5.0, 1000.0, 10.0)
    assert scene.imbalance.mass == masses.mass == 0.18
    assert scene.imbalance.radius == masses.guide_radius == 0.23
    assert masses.friction_arm == (0.01, 0.01)
    assert masses.initial_angle == pytest.approx((0.0, math.pi))
    assert [corner.time for corner in rotor.speed_profile] == [0.0, 120.0, 250.0]
    assert [corner.speed / RPM for corner in rotor.speed_profile] == pytest.approx([100.0, 100.0, 230.0])
    assert scene.lqr.state_weight / scene.lqr.input_weight == 3.5
    assert scene.motor.teeth == (10, 40, 400)
    assert scene.sensor.position_noise == 1e-4
    assert scene.balancer == "eccentric_mass"


def test_each_table_has_its_uncertainties(driven_document: dict[str, Any], load: Load) -> None:
    """By path; an angle may be less than its uncertainty, and a list has one for all its entries."""
    driven_document["imbalance"]["phase"] = "0 deg"
    driven_document["uncertainty"] = {
        "rotor": {"mass": "1 %"},
        "imbalance": {"mass": "10 g", "phase": "5 deg"},
        "masses": {"friction_arm": "10 mm"},
        "motor": {},
    }
    stated = {each.quantity: (each.half_width, each.relative) for each in load(driven_document).uncertainty}
    assert stated == {
        "rotor.mass": (0.01, True),
        "imbalance.mass": (pytest.approx(0.01), False),
        "imbalance.phase": (pytest.approx(math.radians(5)), False),
        "masses.friction_arm": (pytest.approx(0.01), False),
    }


def test_the_washing_machine_runs_through_its_critical_speed() -> None:
    scene = eccentric_scene(load_scene(bundled_scene("washing_machine")))
    critical = math.sqrt(scene.rotor.stiffness / (scene.rotor.mass + 2 * scene.masses.mass))
    speeds = [corner.speed for corner in scene.rotor.speed_profile]
    assert speeds[0] < critical < speeds[-1]
    assert scene.imbalance.mass * scene.imbalance.radius < 2 * scene.masses.mass * scene.masses.guide_radius
    assert scene.sensor.frame == "laboratory"


def test_defaults_that_follow_from_other_values(least_document: dict[str, Any], load: Load) -> None:
    scene = load(least_document)
    assert scene.name == "my_disc"
    capacity, whole = 2 * 0.18 * 0.23, 5.36
    believed = scene.imbalance_filter
    assert believed.initial_unbalance == pytest.approx(capacity)
    assert believed.initial_position == pytest.approx(capacity / whole)
    assert believed.initial_velocity == pytest.approx(capacity / whole * math.sqrt(1000 / whole))
    assert (believed.assumed_mass, believed.assumed_stiffness, believed.assumed_damping) == (5, 1000, 10)
    assert believed.position_noise == pytest.approx(1e-5 * believed.initial_position)
    assert believed.velocity_noise == pytest.approx(1e-5 * believed.initial_velocity)
    assert believed.step == scene.friction_filter.step == scene.lqr.step == scene.sensor.step == 1e-3
    assert scene.friction_filter.initial_friction == pytest.approx(0.023)
    assert scene.fine_tuning.wait == pytest.approx(16 * whole / 10)
    assert scene.fine_tuning.average == pytest.approx(2 * 60 / 100)
    assert scene.supervisor.limit == pytest.approx(0.02 * capacity / whole)
    assert scene.motor.maximum_voltage is None
    assert {"masses.friction_arm", "supervisor.limit", "sensor.frame", "name"} <= set(scene.defaulted)
    assert "rotor.mass" not in scene.defaulted


def test_a_rotor_without_damping_or_speed_still_has_defaults(
    least_document: dict[str, Any], load: Load
) -> None:
    least_document["rotor"]["damping"] = "0 N*s/m"
    least_document["rotor"]["speed_profile"] = [{"time": "0 s", "speed": "0 rpm"}]
    tuning = load(least_document).fine_tuning
    assert (tuning.wait, tuning.average) == (30.0, 1.0)


FAULTS: Mapping[str, tuple[str, Any, str, str]] = {
    "imbalance heavier than the rotor": (
        "imbalance.mass",
        "6 kg",
        "part of the rotor's mass (5 kg)",
        "at most",
    ),
    "more uncertain than it is large": (
        "uncertainty.rotor",
        {"mass": "6 kg"},
        "the uncertainty of mass is larger than mass itself",
        "below 100 %",
    ),
    "uncertainty of a list": (
        "uncertainty.masses",
        {"friction_arm": "11 mm"},
        "the uncertainty of friction_arm is larger",
        "at most the quantity",
    ),
    "masses too long": ("masses.arc_length", "800 mm", "do not fit on the track", "722.566 mm"),
    "masses overlap": ("masses.initial_angle", ["0 deg", "350 deg"], "they are 10 deg apart", "12.4556 deg"),
    "one angle": ("masses.initial_angle", ["0 deg"], "not a list of 2", '["0 deg", "180 deg"]'),
    "friction as a number": (
        "masses.friction_arm",
        [0.01, 0.01],
        "entry 1: a bare number has no unit",
        "a length",
    ),
    "negative friction": (
        "masses.friction_arm",
        ["1 mm", "-1 mm"],
        "entry 2: it must be at least 0",
        "a length",
    ),
    "empty profile": ("rotor.speed_profile", [], "has no entry", "in order of time"),
    "profile that is a number": ("rotor.speed_profile", 100, "it is not a list", "{ time ="),
    "profile backwards": (
        "rotor.speed_profile",
        [{"time": "5 s", "speed": "1 rpm"}, {"time": "5 s", "speed": "2 rpm"}],
        "entry 2 (5 s) does not come after the one before",
        "in order of time",
    ),
    "mass as a length": ("rotor.mass", "5 mm", '"mm" is a unit of length, not of mass', "kg"),
    "stiffness of damping": ("rotor.stiffness", "10 N*s/m", "unit of damping coefficient, not of", "N/m"),
    "no resistance": ("motor.resistance", "0 ohm", "above 0", "ohm"),
    "two gears": ("motor.teeth", [10, 40], "not a list of 3", "[10, 40, 400]"),
    "half a tooth": ("motor.teeth", [10, 40.5, 400], "entry 2: it is not a whole number", "from 1 to"),
    "frame": ("sensor.frame", "fixed", "not one of the known words", '"laboratory"'),
    "filter out of step": ("imbalance_filter.step", "1.5 ms", "not a whole multiple", "0.001 s, 0.002 s"),
    "regulator faster than the sensor": ("lqr.step", "0.5 ms", "not a whole multiple", "0.001 s"),
    "gate of nothing": ("friction_filter.gate", 0, "above 0", "a share"),
    "tuning backwards": ("fine_tuning.stop", "5 deg", "not be longer than the first", "at most 4 deg"),
    "limit in the noise": ("supervisor.limit", "0.05 mm", "is below the sensor noise", "above 0.1 mm"),
    "a liquid ring's table": ("disc", {"bore": "1 mm"}, "unknown table", "rotor, imbalance, masses"),
    "misspelt key": ("masses.guide_radus", "1 m", 'did you mean "guide_radius"', "arc_length"),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=list(FAULTS))
def test_a_fault_is_named_alone(
    fault: tuple[str, Any, str, str], driven_document: dict[str, Any], load: Load
) -> None:
    path, value, problem, allowed = fault
    table, _, key = path.rpartition(".")
    (driven_document[table] if table else driven_document)[key] = value
    with pytest.raises(SceneError) as caught:
        load(driven_document)
    (found,) = caught.value.faults
    assert (found.table, found.key) == ((table, key) if table else (key, ""))
    assert problem in found.problem
    assert allowed in found.allowed
    assert len(str(caught.value).splitlines()) == 1


def test_all_faults_in_one_go_and_in_order(driven_document: dict[str, Any], load: Load) -> None:
    driven_document["lqr"]["state_weight"] = -1
    driven_document["rotor"]["mass"] = "5"
    del driven_document["motor"]["teeth"]
    del driven_document["imbalance"]
    with pytest.raises(SceneError) as caught:
        load(driven_document)
    places = [(fault.table, fault.key) for fault in caught.value.faults]
    assert places == [("rotor", "mass"), ("imbalance", ""), ("motor", "teeth"), ("lqr", "state_weight")]


def test_a_misspelt_balancer_is_not_taken_for_a_liquid_ring(
    driven_document: dict[str, Any], load: Load
) -> None:
    driven_document["balancer"] = "eccentric_masses"
    with pytest.raises(SceneError, match='did you mean "eccentric_mass"') as caught:
        load(driven_document)
    assert [fault.key for fault in caught.value.faults] == ["balancer"]


def test_each_kind_is_distinguished_from_the_other(paper_scene: Scene) -> None:
    driven = load_scene(bundled_scene("eccentric_mass_paper"))
    assert liquid_ring_scene(paper_scene) is paper_scene
    assert eccentric_scene(driven) is driven
    with pytest.raises(SceneError, match=r'balancer = "eccentric_mass": this needs .* liquid_ring'):
        liquid_ring_scene(driven)
    with pytest.raises(SceneError, match=r'balancer = "liquid_ring": this needs .* eccentric_mass'):
        eccentric_scene(paper_scene)


@pytest.mark.parametrize("function", [rb.calibrate, rb.paper_law, lambda scene: rb.run_cases(scene=scene)])
def test_what_needs_a_liquid_refuses_eccentric_masses(function: Callable[[Any], object]) -> None:
    with pytest.raises(SceneError, match='balancer = "liquid_ring"'):
        function(load_scene(bundled_scene("eccentric_mass_paper")))


@pytest.mark.parametrize("table", RECORDS)
def test_keys_are_fields(table: str) -> None:
    """A key reaches the record's field of its name; nothing is written in a file and then ignored."""
    assert _keys(table) == {field.name for field in fields(RECORDS[table])}
    assert set(TABLES) == {*RECORDS, "accuracy", "uncertainty", "fitted", "measured"}


_PATHS = [(table, key) for table in TABLES for key in sorted(_keys(table))]
_JUNK = st.one_of(
    st.floats(-1e3, 1e3).map(lambda value: f"{value} s"),
    st.floats(0, 10).map(lambda value: f"{value} kg"),
    st.floats(0, 10).map(lambda value: f"{value} m"),
    st.floats(-400, 400).map(lambda value: f"{value} deg"),
    st.integers(-5, 5),
    st.floats(),
    st.text(max_size=9),
    st.lists(st.sampled_from(["1 mm", "3 deg", 7, "-2 s", {"time": "1 s"}]), max_size=3),
    st.dictionaries(st.text(max_size=4), st.integers(), max_size=2),
)


@given(changes=st.lists(st.tuples(st.sampled_from(_PATHS), _JUNK), min_size=1, max_size=3))
@settings(max_examples=150, deadline=None, derandomize=True)
def test_junk_ends_in_a_scene_or_in_a_scene_error(
    changes: list[tuple[tuple[str, str], Any]], as_toml: Callable[[Mapping[str, Any]], str]
) -> None:
    document = tomllib.loads(bundled_scene("eccentric_mass_paper").read_text(encoding="utf-8"))
    for (table, key), value in changes:
        document.setdefault(table, {})[key] = value
    scene = _loaded(as_toml(document).encode())
    if scene is not None:
        assert isinstance(scene, EccentricScene)
        assert scene.rotor.mass >= scene.imbalance.mass >= 0
        assert scene.sensor.step <= scene.lqr.step
        assert scene.rotor.speed_profile


def _loaded(content: bytes) -> AnyScene | None:
    try:
        return scene_from(content=content, file="my_disc.toml")
    except SceneError as error:
        lines = str(error).splitlines()
        if not error.faults or len(lines) != len(error.faults) or not all(map(str.isprintable, lines)):
            raise AssertionError("a fault is not one printable line") from error
    return None
