"""A scene with other values is what the file with these values would be; any other change is refused."""

from __future__ import annotations

import copy
import math
import pickle
import tomllib
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.controller.eccentric_mass.scene_records import eccentric_scene
from ringbalance.scene import AnyScene, Scene, SceneError, bundled_scene, load_scene
from ringbalance.scene.changes import document_of, file_text, nameless
from ringbalance.scene.loader import scene_from
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.toml import toml_bytes
from ringbalance.scene.units import DIMENSIONS, parse_quantity
from scenes import with_tables

PAPER, DRIVEN = "liquid_ring_paper", "eccentric_mass_paper"


def bundled(name: str) -> AnyScene:
    """A scene that comes with the program."""
    return load_scene(bundled_scene(name))


def as_file(name: str, **tables: dict[str, Any]) -> AnyScene:
    """The scene of a bundled file with other entries in its tables."""
    path = bundled_scene(name)
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    for table, entries in tables.items():
        document[table] = {**document.get(table, {}), **entries}
    return scene_from(content=toml_bytes(document), file=str(path))


def test_it_is_the_scene_that_the_changed_file_would_be(paper_scene: Scene) -> None:
    changed = paper_scene.with_values({"tube.bore": "2 mm", "rotor.speed": "9000 rpm"}, origin="assumed")
    of_file = as_file(PAPER, tube={"bore": "2 mm"}, rotor={"speed": "9000 rpm"})
    assert isinstance(of_file, Scene)
    assert (changed.tube, changed.rotor, changed.disc) == (of_file.tube, of_file.rotor, of_file.disc)
    assert changed.values_sha256 == of_file.values_sha256 != paper_scene.values_sha256
    assert changed.sha256 != paper_scene.sha256
    assert changed.origin_of("tube.bore") == changed.origin_of("rotor.speed") == "assumed"
    assert changed.origin_of("tube.length") == paper_scene.origin_of("tube.length")
    assert paper_scene.with_values({"tube.bore": "2 mm"}).origin_of("tube.bore") == "given"
    assert paper_scene.tube.bore == 1.5e-3


@pytest.mark.parametrize("dimension", sorted({*DIMENSIONS} - {"share"}))
def test_a_number_is_one_in_si(dimension: str) -> None:
    """What `with_values` writes for a number, the first unit of its dimension, reads back to the last bit."""
    unit = next(iter(DIMENSIONS[dimension].units))
    assert parse_quantity(f"{0.1 + 0.2!r} {unit}", dimension) == 0.1 + 0.2


def test_numbers_lists_and_tables() -> None:
    scene = liquid_ring_scene(bundled(PAPER))
    changed = scene.with_values(
        {
            "tube.bore": np.float64(2e-3),
            "controller.gas_time_offset": np.linspace(0.01, 0.04, 4),
            "rotor.initial_vibration.amplitude": 5e-6,
            "tube.bends": [{"angle": math.pi / 2, "radius": "4 mm"}],
        }
    )
    assert changed.tube.bore == 2e-3
    assert changed.controller.gas_time_offset == (0.01, 0.02, 0.03, 0.04)
    assert (changed.rotor.initial_amplitude, changed.rotor.initial_phase) == (5e-6, math.pi / 2)
    assert changed.tube.bends[0].angle == math.pi / 2
    driven = eccentric_scene(bundled(DRIVEN)).with_values(
        {"rotor.mass": 50, "masses.initial_angle": [0.1, 2.0], "uncertainty.rotor.mass": "3 %"}
    )
    assert (driven.rotor.mass, driven.masses.initial_angle) == (50.0, (0.1, 2.0))
    assert {each.quantity: each.half_width for each in driven.uncertainty}["rotor.mass"] == 0.03


def test_defaults_follow_and_keys_go(paper_scene: Scene) -> None:
    six = paper_scene.with_values(
        {"disc.central_angle": "60 deg", "disc.chambers": None, "controller.sequence": None}
    )
    assert (six.disc.chambers, len(six.controller.sequence)) == (6, 6)
    warm = paper_scene.with_values({"liquid.temperature": "40 degC"})
    assert warm.liquid.kinematic_viscosity < 0.7 * paper_scene.liquid.kinematic_viscosity
    straight = paper_scene.with_values({"tube.hump_radius": None, "uncertainty.hump_radius": None})
    assert straight.tube.hump_radius is None
    assert paper_scene.with_values({}) is paper_scene


def test_everything_wrong_is_reported_at_once(paper_scene: Scene) -> None:
    values = {"tube.bore": "80 mm", "disc.inner_radius": 0.05, "tube.bor": 1, "gas.presure": None}
    with pytest.raises(SceneError) as caught:
        paper_scene.with_values(values)
    found = {(fault.table, fault.key) for fault in caught.value.faults}
    assert {("tube", "bore"), ("disc", "inner_radius"), ("tube", "bor"), ("gas", "presure")} <= found
    for value in (float("nan"), float("inf"), -1e-3, True, "2", "2 s", [1e-3], object()):
        with pytest.raises(SceneError) as caught:
            paper_scene.with_values({"tube.bore": value})
        assert ("tube", "bore") in {(fault.table, fault.key) for fault in caught.value.faults}
    with pytest.raises(TypeError, match=r"tube\.bore"):
        paper_scene.with_values({3: 4})  # type: ignore[dict-item]


def test_an_imported_chamber_keeps_its_mesh(tmp_path: Path) -> None:
    for name in ("imported_chamber.toml", "imported_chamber.msh"):
        (tmp_path / name).write_bytes(bundled_scene("imported_chamber").with_name(name).read_bytes())
    scene = liquid_ring_scene(load_scene(tmp_path / "imported_chamber.toml"))
    changed = scene.with_values({"gas.pressure": "0.6 MPa"})
    assert changed.disc.geometry is scene.disc.geometry
    assert changed.disc == scene.disc
    with pytest.raises(SceneError, match="the mesh decides"):
        scene.with_values({"disc.outer_radius": "50 mm"})
    (tmp_path / "imported_chamber.msh").unlink()
    assert changed.with_values({"gas.pressure": "0.5 MPa"}).disc == scene.disc


@pytest.mark.parametrize("name", [PAPER, DRIVEN, "imported_chamber"])
def test_a_scene_survives_pickling_and_copying(name: str) -> None:
    scene = bundled(name)
    for again in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
        changed = again.with_values({"run.seed": 7})
        assert changed == scene.with_values({"run.seed": 7})


def calls(scene: Any) -> list[Any]:
    """Each function of the interface that takes a scene, called with one."""
    return [
        lambda: rb.calibrate(scene),
        lambda: rb.paper_law(scene),
        lambda: rb.simulate(scene),
        lambda: rb.tune(scene),
        lambda: rb.fit(scene, "rig.csv"),
        lambda: rb.compare(scene, scene),
        lambda: rb.trade(scene),
        lambda: rb.extremes(scene),
        lambda: rb.plot(scene, "out"),
        lambda: rb.write_report(scene, "out"),
        lambda: rb.run_cases(["claim_01_volume"], scene=scene),
        lambda: scene.with_values({"run.seed": 1}),
    ]


def test_a_record_changed_otherwise_is_refused_everywhere(
    paper_scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    driven = eccentric_scene(bundled(DRIVEN))
    wide = with_tables(paper_scene, tube={"bore": 0.08})
    for scene, key in ((wide, "bore"), (with_tables(driven, rotor={"mass": 1.0}), "mass")):
        for call in calls(scene):
            with pytest.raises(SceneError) as caught:
                call()
            assert [fault.key for fault in caught.value.faults] == [key]
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SceneError):
        rb.calibrate(replace(paper_scene, checked=None))
    with pytest.raises(TypeError, match="load_scene"):
        rb.calibrate("liquid_ring_paper.toml")  # type: ignore[arg-type]


def test_another_mesh_under_the_same_name_is_refused() -> None:
    scene = liquid_ring_scene(bundled("imported_chamber"))
    geometry = scene.disc.geometry
    assert geometry is not None
    other = replace(geometry, points=geometry.points * 1.1)
    with pytest.raises(SceneError):
        rb.calibrate(with_tables(scene, disc={"geometry": other}))


@pytest.mark.parametrize(
    "values",
    [{"tube.bore": 1.1e-3, "gas.pressure": "0.5 MPa"}, {"rotor.initial_vibration.amplitude": "5 um"}, {}],
)
def test_a_nameless_scene_has_the_values_and_the_hash_of_the_named_one(values: dict[str, Any]) -> None:
    scene = bundled(PAPER)
    before = toml_bytes(document_of(scene))
    whole, (bare, digest) = scene.with_values(values), nameless(scene, values)
    assert digest == whole.sha256
    # A scene that was not changed has the hash of its file.
    assert not values or digest == sha256(toml_bytes(document_of(whole))).hexdigest()
    blank = {"name": "", "source": "", "sha256": "", "values_sha256": "", "defaulted": (), "origins": ()}
    assert bare == replace(whole, **blank)  # type: ignore[arg-type]
    assert toml_bytes(document_of(scene)) == before
    again = pickle.loads(pickle.dumps(scene))
    assert again.with_values(values).sha256 == digest


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        ("gas.pressure", 0.88e6, "0.88 MPa"),
        ("tube.bore", 1.37e-3, "1.37 mm"),
        ("liquid.temperature", 300.0, "26.85 degC"),
        ("controller.integral_time", 10.0, "10 s"),
        ("controller.integral_time", 30.0, "0.5 min"),
        ("rotor.speed", 1000.0, "1000 rad/s"),
        ("gas.valve_lag", 3e-3, "3 ms"),
        ("gas.dead_volume", 1e-6, "1 ml"),
        ("controller.limit", 1.375e-7, "0.1375 um"),
        ("controller.gas_time_offset", [1e-3, 2e-3, 0.0, 0.0], ["1 ms", "2 ms", "0 ms", "0 ms"]),
    ],
)
def test_a_changed_value_keeps_the_unit_of_its_file(path: str, value: object, text: object) -> None:
    """Where the file has none, the usual unit; in SI where that saves many digits."""
    table, key = path.split(".")
    changed = bundled(PAPER).with_values({path: value})
    found = getattr(getattr(changed, table), key)
    assert (list(found) if isinstance(value, list) else found) == value
    assert tomllib.loads(file_text(changed, to=Path()).decode())[table][key] == text


@pytest.mark.parametrize("whole", [False, True])
def test_what_is_taken_away_is_gone(whole: bool) -> None:
    """Alone, beside what stays, and as a whole table."""
    scene = bundled("spindle_design")
    changes = dict.fromkeys(["design"] if whole else ["design.pressure", "requirement.settling_time"])
    without = scene.with_values(changes)
    assert isinstance(without, Scene)
    assert without.design.pressure is None
    assert (without.requirement.settling_time is None) is not whole
    assert (without.design.axial_width is None) is whole


def test_a_file_has_no_settings_that_only_another_algorithm_reads() -> None:
    settings = {
        kind: tomllib.loads(
            file_text(bundled(PAPER).with_values({"controller.kind": kind}), to=Path()).decode()
        )["controller"]
        for kind in ("target_vector", "law_based", "trial")
    }
    gains = {"proportional", "integral_time", "derivative_time"}
    trial = {"sequence", "first_trial", "long_step", "short_step", "fine_below"}
    for kind, read in (("target_vector", gains), ("law_based", set()), ("trial", trial)):
        assert settings[kind].keys() & (gains | trial) == read
        assert settings[kind]["origin"].keys() <= settings[kind].keys()
