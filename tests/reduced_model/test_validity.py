"""Where the physics ends, a scene is refused or its results say so: nothing absurd passes for good."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from quantities import by_key

from ringbalance.cli import main
from ringbalance.controller.loop import simulate
from ringbalance.physics.gas import pressure_factor
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.scene import bundled_scene
from ringbalance.scene.models import Scene
from scenes import with_tables

SOUND_SPEED = 1482.0
"""m/s, in water at 20 degC."""
BULK_MODULUS = 2.18e9
"""Pa."""


def at_speed(scene: Scene, rpm: float) -> Scene:
    rotor = replace(scene.rotor, speed=rpm * math.pi / 30)
    # Twice the column's pressure over the siphon crest, whatever the speed.
    column = 998 * rotor.speed**2 * (44.5e-3**2 - 31.5e-3**2) / 2
    run = replace(scene.run, time_limit=0.5)
    return with_tables(scene, rotor=rotor, run=run, gas={"pressure": 2 * column})


@pytest.mark.parametrize(("rpm", "code"), [(3e4, "ok"), (9e4, "out_of_range"), (2.1e5, "out_of_range")])
def test_a_liquid_that_pressure_compresses_is_never_ok(paper_scene: Scene, rpm: float, code: str) -> None:
    """At 30,000 rpm 20 MPa on the wall make water 1 % denser, at 90,000 rpm nine times as much."""
    scene = at_speed(paper_scene, rpm)
    found = calibrate(scene)
    document = calibration_document(found)
    assert document["status"]["code"] == code
    assert by_key(document)["lambda"]["status"] == code
    assert document["chamber"]["wall_pressure_status"] == code
    assert simulate(scene, found.model).model_status.code == code
    velocity = np.array(document["law"]["velocity_m_s"])
    good = [status == "ok" for status in document["law"]["column_status"]]
    at_scene = document["law"]["gas_pressure_Pa"].index(scene.gas.pressure)
    assert np.all(np.abs(velocity[at_scene, good]) < 0.2 * SOUND_SPEED)
    rows = zip(document["chamber"]["row_status"], document["chamber"]["wall_pressure_Pa"], strict=True)
    assert all(p + scene.gas.pressure < 0.02 * BULK_MODULUS for status, p in rows if status == "ok")
    if code != "ok":
        assert "liquid_compressed" in document["chamber"]["row_status"]


def test_a_gas_column_is_known_to_a_hundredth_where_it_is_taken(paper_scene: Scene) -> None:
    """Between gas that exchanges heat and gas that does not, at the fastest speed that a scene may have."""
    gas = replace(paper_scene.gas, measured_at="shaft")
    fast = replace(at_speed(paper_scene, 43_990.0), gas=gas)
    isothermal = pressure_factor(fast)
    adiabatic = (1 + 0.4 / 1.4 * math.log(isothermal)) ** 3.5
    assert 0.99 < adiabatic / isothermal < 1


@pytest.mark.parametrize(
    ("place", "speed", "allowed"),
    [("chamber", 3_000_000, 214_593), ("chamber", 214_700, 214_593), ("shaft", 44_100, 44_012)],
)
def test_a_rim_too_fast_ends_the_command_with_the_key_and_the_bound(
    tmp_path: Any, capsys: pytest.CaptureFixture[str], place: str, speed: int, allowed: int
) -> None:
    text = bundled_scene("liquid_ring_paper").read_text(encoding="utf-8")
    document = tomllib.loads(text)
    assert document["rotor"]["speed"] == "10000 rpm"

    def calibrated(rpm: float) -> int:
        file = tmp_path / "disc.toml"
        written = text.replace('"10000 rpm"', f'"{rpm} rpm"').replace(
            "[gas]", f'[gas]\nmeasured_at = "{place}"'
        )
        file.write_text(written, encoding="utf-8")
        return main(["calibrate", str(file), "--json"])

    assert calibrated(speed) == 2
    said = capsys.readouterr()
    assert "[rotor] speed" in said.err
    assert said.out == ""
    assert "Traceback" not in said.err
    assert calibrated(0.999 * allowed) == 0
    assert json.loads(capsys.readouterr().out)["scene"]["name"] == document["name"]
