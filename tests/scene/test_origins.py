"""Where the values of a scene come from, and the hash of those that decide results."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, get_args

import pytest

from ringbalance.scene import AnyScene, Scene, bundled_scene, load_scene, scene_from, scene_table
from ringbalance.scene.origins import Origin

Load = Callable[[Mapping[str, Any]], Scene]
SCENES = sorted(bundled_scene("liquid_ring_paper").parent.glob("*.toml"))


def from_text(text: str) -> AnyScene:
    """A scene from the text of its file."""
    return scene_from(content=text.encode(), file="my.toml")


def test_origins_of_a_scene(newcomer_document: dict[str, Any], load: Load) -> None:
    newcomer_document["tube"]["origin"] = {"bore": "assumed"}
    newcomer_document["rotor"] |= {
        "initial_vibration": {"amplitude": "8 um", "phase": "0 deg"},
        "origin": {"initial_vibration": "measured"},
    }
    scene = load(newcomer_document)
    assert scene.origin_of("tube.bore") == "assumed"
    assert scene.origin_of("tube.length") == "given"
    assert scene.origin_of("tube.roughness") == scene.origin_of("tolerance") == "default"
    assert scene.origin_of("rotor.initial_phase") == "measured"
    rows = {row["quantity"]: row["origin"] for row in scene_table(scene)}
    assert (rows["bore d"], rows["vibration at the start"]) == ("assumed", "measured")
    with pytest.raises(ValueError, match=r"no key 'tube\.boer'"):
        scene.origin_of("tube.boer")


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_remarks_of_bundled_scenes_agree_with_their_origins(path: Path) -> None:
    """A remark that begins with an origin begins with the one that the data have."""
    scene, table, compared = load_scene(path), "", 0
    for line in path.read_text(encoding="utf-8").splitlines():
        table = found[1] if (found := re.match(r"\[(\w+)\]", line)) else table
        key, words = re.match(r"(\w+) = ", line), re.search(rf"# ({'|'.join(get_args(Origin))})\b", line)
        if key and words and table != "uncertainty":
            assert scene.origin_of(f"{table}.{key[1]}") == words[1], line
            compared += 1
    assert compared or path.stem in {"six_chamber", "washing_machine"}


def test_scenes_state_what_is_uncertain() -> None:
    """At least what the chamber, the tube and the loop, or rotor and masses, respond to most."""
    needed = {"outer_radius", "bore", "hump_radius", "pressure", "speed", "lag_angle"}
    for path in SCENES:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
        if document["balancer"] == "liquid_ring":
            sector = "mesh" not in document["disc"]
            plates = {"plate_thickness"} if sector else {"central_angle"}
            assert needed | plates <= set(document["uncertainty"]), path.stem
        else:
            assert {"rotor", "imbalance", "masses", "motor"} <= set(document["uncertainty"]), path.stem
            assert {"stiffness", "damping"} <= set(document["uncertainty"]["rotor"]), path.stem


def test_hash_of_the_values() -> None:
    """A remark, a name, an origin or a requirement does not change it; a value, given or by default, does."""
    text = bundled_scene("six_chamber").read_text(encoding="utf-8")
    plain = from_text(text).values_sha256
    alike = (
        text.replace("# 0.1 %", "# a remark"),
        text.replace("Six-chamber disc", "Another name"),
        text.replace('bore = "assumed"', 'bore = "measured"'),
        text.replace('bore = "1 mm"', 'bore = "0.1 cm"'),
        text.replace('speed = "6000 rpm"', 'speed = "6000 rpm"\nmass = "20 kg"')
        + '[requirement]\ngrade = "2.5 mm/s"\n',
        text.replace('roughness = "1.5 um"\n', "").replace('roughness = "assumed"\n', ""),
    )
    assert all(other != text for other in alike)
    assert {from_text(other).values_sha256 for other in alike} == {plain}
    others = (
        text.replace('bore = "1 mm"', 'bore = "1.1 mm"'),
        text.replace('speed = "6 rpm"', 'speed = "7 rpm"'),
        text.replace("seed = 0", "seed = 1"),
    )
    assert len({plain, *(from_text(other).values_sha256 for other in others)}) == 4


def test_requirement(newcomer_document: dict[str, Any], load: Load) -> None:
    plain = load(newcomer_document)
    assert (plain.requirement.grade, plain.requirement.settling_time, plain.rotor.mass) == (None, None, None)
    newcomer_document["requirement"] = {
        "settling_time": "10 s",
        "residual": "0.1 um",
        "grade": "2.5 mm/s",
        "correction_moment": "900 g*mm",
    }
    newcomer_document["rotor"]["mass"] = "20 kg"
    scene = load(newcomer_document)
    required = scene.requirement
    assert (required.settling_time, required.residual) == (10.0, pytest.approx(1e-7))
    assert required.grade == pytest.approx(2.5e-3)
    assert scene.with_values({"requirement.grade": "G 2.5"}).requirement.grade == required.grade
    assert (required.correction_moment, scene.rotor.mass) == (pytest.approx(9e-4), 20.0)
    assert {"balance quality grade", "mass"} <= {row["quantity"] for row in scene_table(scene)}
