# ruff: noqa: ARG001, ARG005 (methods in place of others have their arguments)
"""A third balancer, one sub-package and one line to register it; the same checks hold for all three."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from random import random
from typing import Any

import numpy as np
import pytest
from ball_balancer.balancer import BallBalancer
from ball_balancer.scene_keys import BallScene
from own_balancers import EXAMPLE

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.balancer import Balancer, Outcomes, balancer_of
from ringbalance.controller.balancer_checks import (
    CHECKS,
    Check,
    checked_scene,
    description,
    problems_of,
    reach,
)
from ringbalance.controller.compare import compare
from ringbalance.identification.reading import template
from ringbalance.scene import registry
from ringbalance.scene.loader import bundled_scene, load_scene, scene_from
from ringbalance.scene.narrowing import scene_as
from ringbalance.scene.registry import imported, known_balancers

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
        "liquid_ring": ("six_chamber", 15.0),
        "eccentric_mass": ("driven_masses_small", 10.0),
    }[request.param]
    return balancer_of(load_scene(bundled_scene(name)).with_values({"run.time_limit": seconds}))


def test_every_balancer_is_checked() -> None:
    assert known_balancers() == ("liquid_ring", "eccentric_mass", "ball")


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_every_balancer(balancer: Balancer, check: Check) -> None:
    assert problems_of(check, balancer) == ()


def _outcomes(**changes: Any) -> dict[str, Any]:
    """A `run` whose outcomes are changed."""

    def run(self: BallBalancer, *args: Any, **options: Any) -> Outcomes:
        outcomes = BallBalancer.run(self, *args, **options)
        return replace(outcomes, **{name: change(outcomes, args) for name, change in changes.items()})

    return {"run": run}


def _nothing(self: BallBalancer, *_: Any, **__: Any) -> tuple[Any, ...]:
    return ()


TRUE_REACH = BallBalancer.reach
MUTATIONS: dict[str, dict[str, Any]] = {
    "inputs": {"inputs": _nothing},
    "settings": {"settings": _nothing},
    "stated_settings": _outcomes(
        final_amplitude=lambda outcomes, args: outcomes.final_amplitude + bool(args[0]) * 1e-9
    ),
    "effects": {"setting_paths": ("vibration.noise",)},
    "repeatable": _outcomes(final_amplitude=lambda outcomes, _: outcomes.final_amplitude + random()),
    "numbers": _outcomes(final_amplitude=lambda outcomes, _: np.arange(outcomes.final_amplitude.size) + 1e-6),
    "devices": _outcomes(final_amplitude=lambda outcomes, _: 0 * outcomes.final_amplitude),
    "settling_times": _outcomes(ended=lambda outcomes, _: ("stalled",) * len(outcomes.ended)),
    "one_run": {"history": lambda self, run: {"time_s": [0.0], "amplitude_m": []}},
    "traces": {
        "run": lambda self, *args, trace=False, **options: BallBalancer.run(
            self.lasting(20.0 if trace else 1.0), *args, trace=trace, **options
        )
    },
    "untraced": {
        "run": lambda self, *args, trace=False, **options: BallBalancer.run(
            self, *args, trace=True, **options
        )
    },
    "rotor": {
        "on_rotor": lambda self, rotor, rotors=None: self.on_scene(
            self.scene.with_values({"rotor.phase": "3 deg"})
        )
    },
    "reach": {"reach": lambda self, device: 0.01 * TRUE_REACH(self, device)},
    "span": {"lasting": lambda self, span: self},
    "pickles": {"__reduce__": lambda self: (type(self), (self.scene.with_values({"run.seed": 9}),))},
    "options": {"options": frozenset(["colour"])},
}


@pytest.mark.parametrize("name", MUTATIONS)
def test_every_check_notices_its_error(balls: BallScene, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Wrong(BallBalancer):
        pass

    for attribute, value in MUTATIONS[name].items():
        setattr(Wrong, attribute, value)
    monkeypatch.setitem(registry._PATHS, ("balancer", "ball"), f"{__name__}:WRONG")
    monkeypatch.setitem(globals(), "WRONG", Wrong)
    monkeypatch.setattr(
        registry, "imported", lambda path: Wrong if path.endswith("WRONG") else imported(path)
    )
    (check,) = (check for check in CHECKS if check.__name__ == name)
    assert problems_of(check, Wrong(balls)) != ()


@pytest.mark.parametrize(
    ("factor", "said"),
    [(0.01, "runs cancel"), (0.8, "runs cancel"), (1.0, ""), (1.3, "of 0.9 of a reach of")],
)
def test_a_false_reach_is_told_from_the_runs(
    balls: BallScene, factor: float, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(BallBalancer, "reach", lambda self, device: factor * TRUE_REACH(self, device))
    problems = problems_of(reach, BallBalancer(balls))
    assert len(problems) == bool(said)
    assert said in " ".join(problems)


TRUE_CORRECTIONS = BallBalancer.corrections


def _measures(self: BallBalancer, device: BallScene, *, measure: Any, **options: Any) -> Any:
    for number in range(200):
        yield 0.1 * number, 0j
        measure(0j)


def _passes(self: BallBalancer, device: BallScene, **options: Any) -> Any:
    for number, (time, correction) in enumerate(TRUE_CORRECTIONS(self, device, **options)):
        yield time, 50 * TRUE_REACH(self, device) if number == 5 else correction


def _as_assumed(self: BallBalancer, device: BallScene, *, assumed: BallScene, **options: Any) -> Any:
    return TRUE_CORRECTIONS(self, replace(device, balls=assumed.balls), assumed=assumed, **options)


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("span", {"sampling_time": lambda self: -1.0}, ("the sampling time is -1 s",)),
        ("span", {"corrections": _measures}, ("the sampling time is 0 s, and runs measure every 0.1 s",)),
        ("span", {"corrections": _measures, "sampling_time": lambda self: 0.1}, ()),
        (
            "reach",
            {"corrections": _passes},
            ("the reach is 0.0001 kg m, and a run passes through 0.005 kg m",),
        ),
        (
            "effects",
            {"corrections": _as_assumed},
            ("balls.mass has none on a drawn device", "balls.drag has none on a drawn device"),
        ),
    ],
)
def test_a_false_statement_is_told_from_the_runs(
    balls: BallScene,
    name: str,
    changes: dict[str, Any],
    said: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for attribute, value in changes.items():
        monkeypatch.setattr(BallBalancer, attribute, value)
    (check,) = (check for check in CHECKS if check.__name__ == name)
    assert problems_of(check, BallBalancer(balls)) == said


def test_an_error_of_every_run_is_said_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(BallBalancer, "corrections", lambda self, device, **options: iter(()))
    assert main(["check-balancer", "ball"]) == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "fails 1 of 18 checks" in text
    assert "its error keeps 11 more from being reached" in text
    assert text.count("yields nothing") == 1
    assert text.count("not reached") == 11


@pytest.mark.parametrize("scene", ["liquid_ring_paper", "six_chamber", "driven_masses_small"])
def test_the_reach_of_the_programs_own_balancers_is_what_their_runs_cancel(scene: str) -> None:
    assert problems_of(reach, balancer_of(load_scene(bundled_scene(scene)))) == ()


def test_the_checks_of_the_last_two_notice_scenes_that_nobody_checks(
    balls: BallScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(BallScene, "with_values", lambda self, values: self)
    assert problems_of(checked_scene, BallBalancer(balls)) != ()
    monkeypatch.setattr(BallScene, "__repr__", lambda self: "a scene")
    assert problems_of(description, BallBalancer(balls)) != ()


def test_the_command_prints_every_check(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check-balancer", "ball", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["passed"]
    assert len(document["checks"]) == len(CHECKS) == 18
    assert main(["check-balancer", "liquid_ring"]) == 2
    assert "its package brings no example; allowed: --scene SCENE with it" in capsys.readouterr().err
    assert main(["check-balancer", "ball", "--scene", "six_chamber"]) == 2
    assert "this is a scene of the balancer liquid_ring" in capsys.readouterr().err


def test_a_failed_check_is_said_with_its_reason(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(BallBalancer, "lasting", lambda self, span: self)
    assert main(["check-balancer", "ball"]) == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "the balancer ball fails 1 of 18 checks" in text
    assert "20.0 s in place of 7.5 s" in text


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
    # Balls take no samples.
    assert result["sampling_time_s"] == [None, ring.sampling_time()]
    (sampled,) = [each for each in result["quantities"] if each["key"] == "1.sampling_time"]
    assert (sampled["value"], sampled["status"]) == (None, "not_sampled")
    # And state no energy.
    (energy,) = [each for each in result["quantities"] if each["key"] == "1.energy"]
    assert (energy["value"], energy["status"]) == (None, "energy_none")
    assert (result["energy_J"][0], result["spread"][0]["energy_J"]) == (None, None)
    with pytest.raises(rb.SceneError, match="below the critical speed"):
        compare(ring, balancer_of(balls), rotor="first")


def test_the_commands_take_the_third_balancer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "balls.toml"
    file.write_bytes(EXAMPLE)
    plot, table = tmp_path / "run.svg", tmp_path / "run.csv"
    assert main(["simulate", str(file), "--json", "--plot", str(plot), "--csv", str(table)]) == 0
    assert json.loads(capsys.readouterr().out)["balancer"] == "ball"
    assert plot.stat().st_size > 1000
    assert table.read_text().startswith("time_s,amplitude_m,")
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
