"""Files that cannot be read, defaults, and what a loaded scene says."""

from __future__ import annotations

import hashlib
import math
import os
import pickle
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from time import process_time
from typing import Any

import pytest

from ringbalance.controller.eccentric_mass.scene_records import eccentric_scene
from ringbalance.scene import (
    Scene,
    SceneError,
    bundled_scene,
    load_scene,
    read_scene,
    scene_from,
    scene_table,
)
from ringbalance.scene.keys.derivations import even_number_of_chambers, trial_sequence
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES, nominal_value, with_value

Load = Callable[[Mapping[str, Any]], Scene]
BUNDLED = (
    "liquid_ring_paper",
    "liquid_ring_paper_calibrated",
    "imported_chamber",
    "silicone_oil_100cst",
    "perfluorinated_oil",
    "six_chamber",
    "grinding_spindle",
    "spindle_design",
)
DRIVEN = ("eccentric_mass_paper", "washing_machine", "driven_masses_small")
"""Tested in test_eccentric_scene.py."""


def paper() -> Scene:
    """The liquid-ring paper's scene, loaded again at each call."""
    return liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))


def _message(path: Path) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    return message


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("none.toml", "none.toml: there is no such file"),
        (".", "this is a folder"),
        ("x" * 300, "cannot be read"),
        ("a\0b", "cannot be read"),
    ],
)
def test_no_file(name: str, words: str, tmp_path: Path) -> None:
    assert words in _message(tmp_path / name)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"name = \n", "line 1"),
        (b"[disc]\n\nbore = 3 mm\n", "line 3"),
        (b'name = "a"\nname = "b"\n', "line 2"),
        (b"a = " + b"[" * 20000, "nested too deeply"),
        (b"seed = " + b"9" * 5000, "this is not TOML"),
        (b'# ok\nname = "\xff"\n', "line 2 is not UTF-8"),
        ('name = "x"'.encode("utf-16"), "not UTF-8"),
        (b"#" * (2**20 + 1), "larger than any scene"),
    ],
)
def test_not_a_scene_file(content: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "my_disc.toml"
    path.write_bytes(content)
    assert words in _message(path)


def test_empty_file_lacks_every_needed_table(tmp_path: Path) -> None:
    path = tmp_path / "empty.toml"
    path.touch()
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    assert [fault.table for fault in caught.value.faults] == ["disc", "liquid", "tube", "gas", "rotor"]


def test_byte_order_mark_and_windows_lines(tmp_path: Path) -> None:
    content = bundled_scene("liquid_ring_paper").read_text(encoding="utf-8")
    path = tmp_path / "windows.toml"
    path.write_bytes(b"\xef\xbb\xbf" + content.replace("\n", "\r\n").encode())
    assert liquid_ring_scene(load_scene(path)).disc == paper().disc


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_scenes(name: str) -> None:
    """Each loads, is named by its file's bytes, and its gas primes the tube down to an empty chamber."""
    path = bundled_scene(name)
    scene = liquid_ring_scene(load_scene(path))
    assert scene.source == f"{name}.toml"
    assert scene.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert scene == load_scene(str(path))
    hump = scene.tube.hump_radius
    assert hump is not None
    head = scene.rotor.speed**2 * (scene.tube.port_radius**2 - hump**2) / 2
    assert scene.gas.pressure > scene.liquid.density * head
    # The ring stands against gravity many times over.
    assert scene.rotor.speed**2 * scene.disc.inner_radius > 100 * scene.environment.gravity


def test_every_scene_file_is_tested() -> None:
    assert sorted((*BUNDLED, *DRIVEN)) == sorted(
        path.stem for path in bundled_scene(BUNDLED[0]).parent.glob("*.toml")
    )


def test_bundled_scene_by_file_name_and_unknown() -> None:
    assert bundled_scene("six_chamber.toml") == bundled_scene("six_chamber")
    with pytest.raises(SceneError, match=r"did you mean \"six_chamber\".*liquid_ring_paper"):
        bundled_scene("six_chambers")


@pytest.mark.parametrize(("angle", "chambers"), [(90, 4), (60, 6)])
def test_angle_and_number_of_chambers_follow_from_each_other(angle: float, chambers: int) -> None:
    scene = paper()
    of_number = scene.with_values(
        {"disc.central_angle": None, "disc.chambers": chambers, "controller.sequence": None}
    )
    of_angle = scene.with_values(
        {"disc.chambers": None, "disc.central_angle": f"{angle} deg", "controller.sequence": None}
    )
    assert of_number.disc.central_angle == pytest.approx(math.radians(angle), rel=1e-15)
    assert of_angle.disc.chambers == chambers
    assert of_number.origin_of("disc.central_angle") == "default"


def test_paper_scene_has_the_papers_values() -> None:
    """Table 1, Eqs. 4 to 6 and section 6 of the liquid-ring paper."""
    scene = paper()
    disc = scene.disc
    assert (disc.outer_radius, disc.inner_radius, disc.axial_width) == (0.0445, 0.0205, 0.062)
    assert disc.central_angle == pytest.approx(math.pi / 2, rel=1e-15)
    assert (disc.chambers, disc.max_fill_ratio, disc.initial_fill) == (4, 0.5, 0.25)
    area = disc.central_angle / 2 * (disc.outer_radius**2 - disc.inner_radius**2)
    area -= 2 * disc.plate_thickness * (disc.outer_radius - disc.inner_radius)
    assert area * disc.axial_width == pytest.approx(67.7e-6, abs=0.05e-6)
    assert scene.liquid.density == 1000.0
    assert scene.rotor.speed == pytest.approx(10000 * math.pi / 30, rel=1e-15)
    assert scene.gas.pressure == 7e5
    controller = scene.controller
    assert (controller.proportional, controller.integral_time, controller.derivative_time) == (
        8e4,
        48.0,
        0.06,
    )
    assert (controller.limit, controller.fine_below) == (5e-8, 8e-7)
    assert controller.sequence == ("A", "C", "B", "D")


def test_newcomers_scene(newcomer_document: dict[str, Any], load: Load) -> None:
    """Disc, liquid, tube, gas and speed are enough; the rest is default and marked as such."""
    scene = load(newcomer_document)
    assert scene.name == "my_disc"
    assert (scene.disc.chambers, scene.disc.plate_thickness) == (6, 0.0)
    assert (scene.disc.max_fill_ratio, scene.disc.initial_fill) == (0.5, 0.25)
    assert scene.tube.port_radius == scene.disc.outer_radius
    assert (scene.tube.hump_radius, scene.tube.bends, scene.tube.entrance) == (None, (), "sharp")
    assert (scene.environment.shaft, scene.environment.gravity) == ("horizontal", 9.80665)
    assert (scene.gas.ambient_pressure, scene.gas.conductance) == (101325.0, None)
    assert scene.controller.sequence == ("A", "D", "B", "E", "C", "F")
    assert scene.controller.assumed_lag_angle == scene.rotor.lag_angle
    assert scene.tolerance == 0.01
    assert {"rotor.influence_coefficient", "disc.chambers", "tube.port_radius"} <= set(scene.defaulted)
    assert not {"disc.outer_radius", "rotor.speed", "liquid.density"} & set(scene.defaulted)


def test_defaults_follow_what_is_given(newcomer_document: dict[str, Any], load: Load) -> None:
    newcomer_document["rotor"] |= {"influence_coefficient": "0.02 um/(g*mm)", "lag_angle": "377 deg"}
    newcomer_document["disc"] |= {"max_fill_ratio": 0.3}
    scene = load(newcomer_document)
    assert scene.controller.assumed_influence_coefficient == 0.02
    assert scene.rotor.lag_angle == pytest.approx(math.radians(17), rel=1e-14)
    assert scene.controller.assumed_lag_angle == scene.rotor.lag_angle
    assert scene.disc.initial_fill == 0.15


def test_outright_properties_win(newcomer_document: dict[str, Any], load: Load) -> None:
    newcomer_document["liquid"] = {"name": "water", "temperature": "20 degC", "density": "1 g/ml"}
    liquid = load(newcomer_document).liquid
    assert (liquid.density, liquid.density_uncertainty) == (1000.0, 0.0)
    assert liquid.kinematic_viscosity == pytest.approx(1.0034e-6, rel=1e-5)
    assert liquid.viscosity_uncertainty == 0.01
    assert liquid.vapour_pressure == pytest.approx(2339.3, rel=1e-4)
    assert "density given outright" in liquid.source


@pytest.mark.parametrize(
    "extra", [{}, {"name": "glycol mix"}, {"name": "water"}, {"temperature": "-20 degC"}]
)
def test_custom_liquid(extra: dict[str, str], newcomer_document: dict[str, Any], load: Load) -> None:
    given = {"density": "1100 kg/m^3", "kinematic_viscosity": "5 cSt"}
    newcomer_document["liquid"] = given | extra
    liquid = load(newcomer_document).liquid
    assert (liquid.density, liquid.kinematic_viscosity, liquid.vapour_pressure) == (1100.0, 5e-6, 0.0)
    assert (liquid.density_uncertainty, liquid.viscosity_uncertainty) == (0.0, 0.0)
    assert liquid.name == extra.get("name", "custom")
    assert "vapour pressure not given, taken as 0 Pa" in liquid.source


def test_uncertainty_of_a_liquid(newcomer_document: dict[str, Any], load: Load) -> None:
    newcomer_document["uncertainty"] = {
        "density": "10 kg/m^3",
        "kinematic_viscosity": "7 %",
        "bore": "0.02 mm",
    }
    scene = load(newcomer_document)
    assert scene.liquid.density_uncertainty == pytest.approx(10 / scene.liquid.density, rel=1e-15)
    assert scene.liquid.viscosity_uncertainty == 0.07
    spreads = {each.quantity: (each.half_width, each.relative) for each in scene.uncertainty}
    assert spreads == {"density": (10.0, False), "kinematic_viscosity": (0.07, True), "bore": (2e-5, False)}


@pytest.mark.parametrize(
    ("written", "offsets"),
    [("30 ms", (0.03,) * 4), (["10 ms", "20 ms", "0.03 s", "0 s"], (0.01, 0.02, 0.03, 0.0))],
)
def test_one_offset_for_all_valves_or_one_for_each(
    paper_document: dict[str, Any], load: Load, written: Any, offsets: tuple[float, ...]
) -> None:
    paper_document["controller"]["gas_time_offset"] = written
    assert load(paper_document).controller.offsets(4) == pytest.approx(offsets)


def test_prescribed_drag_needs_no_length(newcomer_document: dict[str, Any], load: Load) -> None:
    newcomer_document["tube"] = {"bore": "2 mm", "drag_coefficient": 50}
    assert load(newcomer_document).tube.length == pytest.approx(0.12, rel=1e-15)
    newcomer_document["tube"]["hump_radius"] = "45 mm"
    longer = 2 * math.sqrt(60**2 - 45**2) + 45 * (math.pi - 2 * math.acos(0.75))
    assert load(newcomer_document).tube.length == pytest.approx(1e-3 * longer, rel=1e-14)


@pytest.mark.parametrize(
    ("degrees", "chambers"),
    [(180, None), (90, 4), (60, 6), (36, 10), (120, None), (72, None), (100, None), (89, None)],
)
def test_even_number_of_chambers(degrees: float, chambers: int | None) -> None:
    assert even_number_of_chambers(math.radians(degrees)) == chambers


@pytest.mark.parametrize("chambers", [2, 4, 6, 26])
def test_trial_sequence_alternates_opposites(chambers: int) -> None:
    sequence = trial_sequence(chambers)
    assert sorted(sequence) == [chr(ord("A") + i) for i in range(chambers)]
    assert all(
        ord(second) - ord(first) == chambers // 2
        for first, second in zip(sequence[::2], sequence[1::2], strict=True)
    )


def test_table_of_a_scene(newcomer_document: dict[str, Any], load: Load) -> None:
    newcomer_document["uncertainty"] = {"bore": "0.02 mm", "lag_angle": "3 deg", "speed": "1 %"}
    rows = {(row["group"], row["quantity"]): row for row in scene_table(load(newcomer_document))}
    assert rows["Disc", "outer radius R2"]["value"] == "60 mm"
    assert rows["Rotor", "speed"]["value"] == "6000 rpm"
    assert rows["Rotor", "speed"]["uncertainty"] == "1 %"
    assert rows["Rotor", "lag angle"]["uncertainty"] == "3 deg"
    assert (rows["Rotor", "speed"]["origin"], rows["Rotor", "lag angle"]["origin"]) == ("given", "default")
    assert rows["Connecting tube", "bore d"]["uncertainty"] == "0.02 mm"
    assert rows["Connecting tube", "siphon crest radius"]["value"] == "none: always full"
    assert rows["Liquid", "temperature"]["value"] == "25 degC"
    assert rows["Run", "tolerance"]["value"] == "1 %"


def test_a_scene_is_named_as_the_user_named_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "discs").mkdir()
    (tmp_path / "discs" / "one.toml").write_bytes(bundled_scene("liquid_ring_paper").read_bytes())
    monkeypatch.chdir(tmp_path)
    scene = load_scene("discs/one.toml")
    with pytest.raises(SceneError, match=r"^discs/one\.toml: balancer"):
        eccentric_scene(scene)
    assert scene.source == "one.toml"
    assert scene == load_scene(tmp_path / "discs" / "one.toml")


def test_a_scene_and_its_text_are_read_from_a_pipe(tmp_path: Path) -> None:
    pipe, text = tmp_path / "pipe", bundled_scene("liquid_ring_paper").read_text(encoding="utf-8")
    os.mkfifo(pipe)
    writer = threading.Thread(target=lambda: pipe.write_text(text, encoding="utf-8"))
    writer.start()
    scene, read = read_scene(pipe)
    writer.join()
    assert read == text
    assert scene.sha256 == load_scene(bundled_scene("liquid_ring_paper")).sha256


def test_one_quantity_changed() -> None:
    scene = paper()
    for quantity in UNCERTAIN_QUANTITIES:
        changed = with_value(scene=scene, quantity=quantity, value=0.125)
        assert nominal_value(scene=changed, quantity=quantity) == 0.125
        assert changed != scene
        back = getattr(getattr(scene, UNCERTAIN_QUANTITIES[quantity]), quantity)
        assert with_value(scene=changed, quantity=quantity, value=back) == scene
    with pytest.raises(ValueError, match="'colour' is none of"):
        nominal_value(scene=scene, quantity="colour")
    imported = liquid_ring_scene(load_scene(bundled_scene("imported_chamber")))
    absent = [each for each in UNCERTAIN_QUANTITIES if nominal_value(scene=imported, quantity=each) is None]
    assert {"plate_thickness", "hump_radius"} & set(absent) == {"plate_thickness"}


@pytest.mark.parametrize("where", ["at the top", "in a table", "as tables"])
def test_thousands_of_errors_are_counted_not_listed(where: str) -> None:
    text, many = bundled_scene("liquid_ring_paper").read_text(encoding="utf-8"), range(10_000)
    keys = "".join(f"outer_radiu{n} = 1\n" for n in many)
    content = {
        "at the top": keys + text,
        "in a table": text.replace("[disc]\n", f"[disc]\n{keys}"),
        "as tables": text + "".join(f"\n[disk{n}]" for n in many),
    }[where]
    start = process_time()
    with pytest.raises(SceneError) as error:
        scene_from(content=content.encode(), file="many.toml")
    assert process_time() - start < 5.0
    lines = str(error.value).splitlines()
    assert len(error.value.faults) == 10_000
    assert len(lines) == 51
    assert all("did you mean" in line or "allowed: " in line for line in lines[:50])
    assert lines[-1] == "many.toml: and 9950 more; correct these first"
    assert len(pickle.loads(pickle.dumps(error.value)).faults) == 10_000
