"""Scenes with two eccentric masses: values, defaults, every fault by name, and the way to each kind."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import pytest

import ringbalance as rb
from ringbalance.controller.eccentric_mass import control_records, scene_records
from ringbalance.controller.eccentric_mass.scene_records import (
    ECCENTRIC_MASS,
    EccentricScene,
    eccentric_scene,
)
from ringbalance.scene import (
    Scene,
    SceneError,
    bundled_scene,
    liquid_ring_scene,
    load_scene,
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
    "requirement": scene_records.EccentricRequirement,
    "design": scene_records.EccentricDesign,
}


def _keys(table: str) -> set[str]:
    return set(ECCENTRIC_MASS.tables[table].keys) - {ORIGIN}


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


def test_the_mean_is_as_precise_as_the_limit_needs(least_document: dict[str, Any], load: Load) -> None:
    """Whole turns, two at least; 2 sigma / sqrt(n) at most a twentieth of the limit; 30 s at most."""
    turn, sensor = 60 / 100, least_document.setdefault("sensor", {})
    for step, turns in (("1 ms", 2), ("0.01 s", 3), ("0.1 s", 30), ("1 s", 50)):
        # A limit of three standard deviations: 178 samples.
        sensor.update({"step": step, "position_noise": "0.1 mm"})
        least_document["supervisor"] = {"limit": "0.3 mm"}
        scene = load(least_document)
        assert scene.fine_tuning.average == pytest.approx(turns * turn)
        assert scene.mean_noise <= 0.05 * scene.supervisor.limit or scene.fine_tuning.average >= 30


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
