"""A fitted scene on disk: every key kept, values, intervals and origins in place, or no file at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.controller.eccentric_mass.scene_records import eccentric_scene
from ringbalance.identification.fitting import FittedParameter
from ringbalance.identification.identifiability import Identified
from ringbalance.identification.intervals import Profile
from ringbalance.identification.saving import _fitted_scene
from ringbalance.scene import AnyScene, SceneError, bundled_scene, load_scene, scene_from
from ringbalance.scene.changes import document_of, file_text
from ringbalance.scene.describe import scene_table
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import MeasuredFile, MeasuredFinding

FILE = MeasuredFile(file="run.csv", kind="injection", rows=40, sha256="ab" * 32)
SCENES = ("liquid_ring_paper", "perfluorinated_oil", "six_chamber", "eccentric_mass_paper", "washing_machine")

PROFILE = Profile(low=0.0, high=0.0, low_bound=False, high_bound=False, factor=2.0, ends=((), ()), points=())


def fitted(path: str, value: float, width: float, **more: Any) -> FittedParameter:
    told: dict[str, Any] = {
        "name": path,
        "before": 1.1 * value,
        "before_interval": (value, 1.2 * value),
        "before_source": "[uncertainty]",
        "value": value,
        "interval": (value - width, value + width),
        "at_bound": (False, False),
        "verdict": Identified.IDENTIFIED,
        "text": "",
        "profile": PROFILE,
    }
    return FittedParameter(**told | more)


def read_again(scene: AnyScene) -> AnyScene:
    return scene_from(content=file_text(scene, to=Path.cwd(), all_keys=True), file="a.toml")


def saved(name: str, *parameters: FittedParameter) -> AnyScene:
    """A bundled scene with fitted values, written and read again."""
    scene = load_scene(bundled_scene(name))
    return read_again(_fitted_scene(scene, fitted=parameters, files=[FILE]))


BORE = fitted("tube.bore", 1.4e-3, 0.02e-3)
FACTOR = fitted("disc.lambda_factor", 0.97, 0.01, before=1.0, before_interval=None, before_source=None)


def test_values_uncertainties_and_origins() -> None:
    lag = fitted("rotor.lag_angle", -0.01, 0.05)
    loss = fitted("tube.extra_loss", 2.0, 0.5, verdict=Identified.PRACTICALLY)
    result = _fitted_scene(
        load_scene(bundled_scene("liquid_ring_paper")),
        fitted=[BORE, FACTOR, lag, loss],
        files=[FILE],
        findings=[MeasuredFinding(about="combination", text="lambda^2/(k + 1)")],
    )
    scene = liquid_ring_scene(read_again(result))
    assert scene.tube.bore == pytest.approx(1.4e-3, rel=1e-9)
    assert scene.disc.moment_factor == pytest.approx(0.97, rel=1e-9)
    assert scene.rotor.lag_angle == pytest.approx(-0.01, rel=1e-8)
    widths = {each.quantity: (each.half_width, each.relative) for each in scene.uncertainty}
    assert widths["bore"] == (pytest.approx(0.02e-3, rel=1e-8), False)
    assert widths["lag_angle"] == (pytest.approx(0.05, rel=1e-8), False)
    assert widths["lambda_factor"] == (pytest.approx(0.01), False)
    assert scene.origin_of("tube.bore") == "measured"
    assert scene.origin_of("tube.extra_loss") == "inferred"
    assert scene.origin_of("tube.length") == "assumed"
    rows = {row["path"]: row for row in scene_table(scene)}
    assert rows["disc.lambda_factor"]["value"] == "0.97"
    assert rows["disc.lambda_factor"]["origin"] == "measured"
    (bore, factor, *_), (finding,) = scene.measured.quantities, scene.measured.findings
    assert (bore.unit, bore.before, bore.before_high, bore.value, bore.low) == ("mm", 1.54, 1.68, 1.4, 1.38)
    assert (factor.unit, factor.before, factor.before_low) == ("1", 1.0, None)
    assert (scene.measured.files, finding.text) == ((FILE,), "lambda^2/(k + 1)")


@pytest.mark.parametrize("name", SCENES)
def test_every_key_stays(name: str) -> None:
    """Without fitted values the saved scene is the same one but for what it says of its measurements."""
    before = load_scene(bundled_scene(name))
    scene = saved(name)
    document = dict(document_of(scene))
    assert document.pop("measured")["files"] == [
        {"file": "run.csv", "kind": "injection", "rows": 40, "sha256": "ab" * 32}
    ]
    assert document == document_of(before)
    assert scene.values_sha256 == before.values_sha256


def test_entries_of_a_list_share_the_larger_uncertainty() -> None:
    arms = [fitted("masses.friction_arm[1]", 0.012, 0.002), fitted("masses.friction_arm[0]", 0.01, 0.001)]
    scene = eccentric_scene(saved("eccentric_mass_paper", *arms))
    assert scene.masses.friction_arm == pytest.approx((0.01, 0.012), rel=1e-9)
    widths = {each.quantity: each.half_width for each in scene.uncertainty}
    assert widths["masses.friction_arm"] == pytest.approx(0.002, rel=1e-8)
    assert scene.origin_of("masses.friction_arm") == "measured"


def test_an_entry_fitted_alone_leaves_the_uncertainty_of_both() -> None:
    """The key stands for both masses, and nothing was learnt of the other one."""
    arm = fitted("masses.friction_arm[0]", 0.012, 0.001)
    scene = eccentric_scene(saved("eccentric_mass_paper", arm))
    assert scene.masses.friction_arm == pytest.approx((0.012, 0.01), rel=1e-9)
    assert document_of(scene)["uncertainty"]["masses"]["friction_arm"] == "25 %"
    assert "friction_arm[0] was fitted alone" in scene.measured.findings[0].text


def test_an_interval_that_a_scene_cannot_state_is_said() -> None:
    wide = fitted("tube.extra_loss", 0.2, 0.1, interval=(0.01, 0.9))
    scene = saved("six_chamber", wide)
    assert {each.quantity: each.half_width for each in scene.uncertainty}["extra_loss"] == pytest.approx(0.2)
    assert "tube.extra_loss" in scene.measured.findings[0].text


def test_values_that_make_no_scene_are_refused() -> None:
    with pytest.raises(SceneError, match="hump_radius"):
        saved("liquid_ring_paper", fitted("tube.hump_radius", 0.09, 0.001))


@pytest.mark.parametrize("path", ["tube.colour", "nothing.bore", "colour", "masses.mass"])
def test_a_path_that_no_scene_has_is_refused(path: str) -> None:
    with pytest.raises(ValueError, match="no value"):
        saved("six_chamber", fitted(path, 1.0, 0.1))


@given(value=st.floats(1.01e-3, 2e-3), share=st.floats(1e-6, 0.9))
def test_saving_loses_nothing_that_matters(value: float, share: float) -> None:
    scene = liquid_ring_scene(saved("liquid_ring_paper", fitted("tube.bore", value, share * value)))
    assert scene.tube.bore == pytest.approx(value, rel=1e-8)
    width = {each.quantity: each.half_width for each in scene.uncertainty}["bore"]
    assert width == pytest.approx(share * value, rel=1e-7)


def test_a_mesh_is_found_from_another_folder(tmp_path: Path) -> None:
    before = load_scene(bundled_scene("imported_chamber"))
    content = file_text(_fitted_scene(before, fitted=[], files=[FILE]), to=tmp_path)
    (tmp_path / "disc.toml").write_bytes(content)
    assert load_scene(tmp_path / "disc.toml").values_sha256 == before.values_sha256
