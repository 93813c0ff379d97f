"""Influence coefficients over speed: a Jeffcott rotor through its critical speed, in every convention."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.scene.faults import SceneError

CRITICAL, DAMPING, MASS = 400.0, 0.03, 12.0
"""rad/s, ratio, kg."""


def jeffcott(speed: np.ndarray | float) -> np.ndarray:
    """Vibration over unbalance, m/(kg m), zero-to-peak, with exp(+jwt)."""
    r = np.asarray(speed) / CRITICAL
    return np.asarray(r**2 / (1 - r**2 + 2j * DAMPING * r) / MASS)


def written(folder: Path, *, kind: str, sign: str, vibration: str = "zero-to-peak") -> Path:
    """Every 40 rad/s, 10 % of the critical speed, which turns H by more than half a turn from row to row."""
    speed = np.arange(100.0, 821.0, 40.0)
    given = jeffcott(speed) * {"zero-to-peak": 1.0, "peak-to-peak": 2.0, "rms": np.sqrt(0.5)}[vibration]
    if kind == "polar":
        turn = {"lag": -1, "lead": 1}[sign]
        heads = f'# vibration = "{vibration}"\n# angle = "{sign}"\n'
        heads += "speed [rad/s],amplitude [m/(kg*m)],angle [deg]\n"
        cells = np.stack([speed, np.abs(given), turn * np.degrees(np.angle(given))])
    else:
        turn = {"exp(+jwt)": 1, "exp(-jwt)": -1}[sign]
        heads = f'# vibration = "{vibration}"\n# convention = "{sign}"\n'
        heads += "speed [rad/s],real [m/(kg*m)],imaginary [m/(kg*m)]\n"
        cells = np.stack([speed, given.real, turn * given.imag])
    file = folder / "influence.csv"
    file.write_text(heads + "".join(",".join(map(repr, row)) + "\n" for row in cells.T.tolist()))
    return file


@pytest.mark.parametrize(
    ("kind", "sign", "vibration"),
    [
        ("polar", "lag", "zero-to-peak"),
        ("polar", "lead", "peak-to-peak"),
        ("cartesian", "exp(+jwt)", "rms"),
        ("cartesian", "exp(-jwt)", "zero-to-peak"),
    ],
)
def test_a_jeffcott_rotor_is_met_through_its_critical_speed(
    tmp_path: Path, kind: str, sign: str, vibration: str
) -> None:
    table = rb.read_influence(written(tmp_path, kind=kind, sign=sign, vibration=vibration))
    for speed in (103.0, 390.0, 397.0, CRITICAL, 404.0, 800.0):
        assert table.at(speed) == pytest.approx(complex(jeffcott(speed)), rel=1e-9)
    lag = table.rotor(CRITICAL)["rotor.lag_angle"]
    assert lag == pytest.approx(np.pi / 2)


def test_a_scene_takes_it(tmp_path: Path) -> None:
    table = rb.read_influence(written(tmp_path, kind="polar", sign="lag"))
    scene = rb.load_scene(rb.bundled_scene("six_chamber")).with_values({"rotor.speed": "500 rad/s"})
    assert isinstance(scene, rb.Scene)
    changed = scene.with_values(table.rotor(scene.rotor.speed))
    assert changed.rotor.influence == pytest.approx(complex(jeffcott(500.0)), rel=1e-9)
    with pytest.raises(ValueError, match="not for 900 rad/s"):
        table.at(900.0)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (('# angle = "lag"\n', ""), "lag or lead"),
        (('# vibration = "zero-to-peak"\n', ""), "peak-to-peak"),
        (('"lag"', '"behind"'), "lag or lead"),
        (("angle [deg]", "phase [deg]"), 'no column "angle"'),
        (("[m/(kg*m)]", "[kg]"), "kg"),
        (("140.0,", "100.0,"), "each once"),
    ],
)
def test_what_a_file_does_not_say_is_not_guessed(tmp_path: Path, change: tuple[str, str], told: str) -> None:
    file = written(tmp_path, kind="polar", sign="lag")
    file.write_text(file.read_text().replace(*change))
    with pytest.raises(SceneError) as caught:
        rb.read_influence(file)
    assert told in str(caught.value)
