"""A third balancer, one sub-package and one line to register it; the same checks hold for all three."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from balancer_checks import CHECKS, Check, short
from ball_balancer.scene_keys import BallScene
from own_balancers import EXAMPLE

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.balancer import Balancer, balancer_of
from ringbalance.controller.compare import compare
from ringbalance.identification.reading import template
from ringbalance.scene.loader import bundled_scene, load_scene, scene_from
from ringbalance.scene.narrowing import scene_as
from ringbalance.scene.registry import known_balancers

pytestmark = pytest.mark.usefixtures("ball_registered")


@pytest.fixture(scope="module")
def balls() -> BallScene:
    return scene_as(BallScene, scene_from(content=EXAMPLE, file="balls.toml"))


@pytest.fixture(scope="module", params=["liquid_ring", "eccentric_mass", "ball"])
def balancer(request: pytest.FixtureRequest, balls: BallScene) -> Balancer:
    """Of a scene whose runs are short; its law is the paper's, which needs no tables."""
    if request.param == "ball":
        return balancer_of(balls)
    name, seconds = {
        "liquid_ring": ("six_chamber", 4.0),
        "eccentric_mass": ("driven_masses_small", 3.0),
    }[request.param]
    return short(load_scene(bundled_scene(name)), seconds)


def test_every_balancer_is_checked() -> None:
    assert known_balancers() == ("liquid_ring", "eccentric_mass", "ball")


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_every_balancer(balancer: Balancer, check: Check) -> None:
    check(balancer)


def test_balls_above_the_critical_speed_balance_and_below_it_do_not(balls: BallScene) -> None:
    """Two balls of 1 g at 50 mm carry 100 g mm; 80 g mm are cancelled, 120 leave 20 g mm."""
    run = rb.simulate(balls)
    assert run.settled
    assert run.amplitude[-1] < 1e-3 * run.amplitude[0]
    heavy = rb.simulate(balls.with_values({"rotor.unbalance": "120 g*mm"}))
    assert not heavy.settled
    assert heavy.amplitude[-1] == pytest.approx(0.5 * 20e-6, rel=1e-2)
    slow = rb.simulate(balls.with_values({"rotor.lag_angle": "5 deg"}))
    assert slow.amplitude[-1] == pytest.approx(0.5 * 180e-6, rel=1e-2)


def test_the_third_balancer_is_compared(balls: BallScene) -> None:
    paper = load_scene(bundled_scene("liquid_ring_paper"))
    ring = balancer_of(paper.with_values({"run.time_limit": "2 s"}), flow_law="paper")
    result = compare(balancer_of(balls), ring, rotor="first", most=4).to_dict()
    assert result["balancer"] == ["ball", "liquid_ring"]
    assert result["fraction"][0]["value"] > 0.5
    assert result["rotor"]["unbalance_kg_m"] == pytest.approx([80e-6, 0.0])
    with pytest.raises(rb.SceneError, match="below the critical speed"):
        compare(ring, balancer_of(balls), rotor="first")


def test_the_commands_take_the_third_balancer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "balls.toml"
    file.write_bytes(EXAMPLE)
    plot, table = tmp_path / "run.svg", tmp_path / "run.csv"
    assert main(["simulate", str(file), "--json", "--plot", str(plot), "--csv", str(table)]) == 0
    assert json.loads(capsys.readouterr().out)["balancer"] == "ball"
    assert plot.stat().st_size > 1000
    assert table.read_text().startswith("time_s,amplitude_m\n")
    assert main(["tune", str(file), "--save", str(tmp_path / "tuned.toml")]) == 0
    assert "balls.drag" in capsys.readouterr().out
    assert load_scene(tmp_path / "tuned.toml").balancer == "ball"
    assert main(["compare", str(file), str(file)]) == 0
    assert "ball" in capsys.readouterr().out
    assert main(["calibrate", str(file)]) == 2
    assert "this needs a scene of the balancer liquid_ring" in capsys.readouterr().err
    assert main(["simulate", str(file), "--law", "paper"]) == 2
    assert "has no flow law" in capsys.readouterr().err


def test_an_error_of_its_scene_names_the_key() -> None:
    wrong = EXAMPLE.replace(b'mass = "1 g"', b'mass = "1 mm"')
    with pytest.raises(rb.SceneError, match=r"\[balls\] mass"):
        scene_from(content=wrong, file="balls.toml")


def test_the_third_balancer_is_fitted(balls: BallScene, tmp_path: Path) -> None:
    """Trial weights are of any rotor; other data tell nothing of balls."""
    weights = 1e-6 * np.array([0.0, 100, 100, 200, 0])
    angles = np.radians([0.0, 0, 120, 240, 0])
    seen = 4e-5 + 0.52 * np.exp(-1j * math.radians(172)) * weights * np.exp(1j * angles)
    seen += 1e-8 * np.array([1, -1j, 1j, -1, 1 + 1j])
    rows = [
        f"{1e6 * u:g},{math.degrees(a):g},{1e6 * abs(v):.4f},{math.degrees(np.angle(v)):.4f},a,{i}"
        for i, (u, a, v) in enumerate(zip(weights, angles, seen, strict=True))
    ]
    path = tmp_path / "weights.csv"
    head, _, _ = template("trial_weight").partition("##")
    head = head.replace('source = ""', 'source = "rig"').replace(
        'amplitude = ""', 'amplitude = "zero_to_peak"'
    )
    columns = "unbalance [g*mm],angle [deg],amplitude [um],phase [deg],series,note"
    path.write_text("\n".join([f"{head}{columns}", *rows]) + "\n", encoding="utf-8")
    result = {each.name: each for each in rb.fit(balls, path).parameters}
    assert list(result) == ["rotor.influence_coefficient", "rotor.lag_angle"]
    assert result["rotor.influence_coefficient"].value == pytest.approx(0.52, rel=1e-3)
    assert math.degrees(result["rotor.lag_angle"].value) == pytest.approx(172, abs=0.2)
    path.write_text(template("run_up") + "90,400,10,a\n", encoding="utf-8")
    with pytest.raises(rb.SceneError, match="tell nothing of"):
        rb.fit(balls, path)
