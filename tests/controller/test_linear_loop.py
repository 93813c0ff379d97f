"""The linear loop in matrices: its signs against the disc, its margins against scans of the unit circle."""

from __future__ import annotations

import math
import re
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.controller.liquid_ring.linear_loop import LinearLoop
from ringbalance.controller.liquid_ring.loop_factor import default_gain, loop_margins, loop_rate
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.flow_law import BalancerModel, CompleteLaw
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import with_values_at

CIRCLE = np.exp(1j * np.linspace(1e-6, 2 * np.pi - 1e-6, 200_001))


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Nearly balanced, with an exact sensor and P alone."""
    values = {
        "sensor.amplitude_noise": "0 m",
        "sensor.phase_noise": "0 deg",
        "rotor.initial_vibration.amplitude": "0.3 um",
        "controller.integral_time": None,
        "controller.derivative_time": None,
        "controller.limit": "0.01 um",
    }
    return cast(Scene, rb.load_scene(rb.bundled_scene("six_chamber")).with_values(values))


@pytest.fixture(scope="module")
def law(scene: Scene) -> CompleteLaw:
    return rb.calibrate(scene).flow_law


def vibration_of(seen: rb.Measurement | None) -> complex:
    assert seen is not None
    return complex(seen.amplitude * np.exp(1j * seen.phase))


def complex_of(matrix: np.ndarray) -> complex:
    assert matrix[0, 0] == matrix[1, 1]
    assert matrix[0, 1] == -matrix[1, 0]
    return complex(matrix[0, 0], matrix[1, 0])


def test_the_plant_has_frame_sign_and_size_of_a_run(scene: Scene, law: CompleteLaw) -> None:
    loop = rb.linear_loop(scene, flow_law=law)
    run = simulate(scene, BalancerModel.of(law), modelled=[])
    first = run.samples[0]
    before, after = (vibration_of(each.measurement) for each in run.samples[:2])
    axes = np.exp(2j * np.pi * np.arange(6) / 6)
    gas = sum(axes[valve.chamber] * valve.duration for valve in first.command.valves)
    change = complex_of(loop.plant.b) * gas
    assert abs(after - before - change) < 0.1 * abs(change)
    asked = complex_of(loop.controller.d) * before
    assert asked == pytest.approx(gas, rel=0.02)


@pytest.mark.parametrize(("gain", "lag"), [(0.3, 0.0), (1.1, 0.2), (1.7, -0.3)])
def test_margins_in_closed_form_are_those_of_the_unit_circle(
    scene: Scene, law: CompleteLaw, gain: float, lag: float
) -> None:
    own = rb.linear_loop(scene, flow_law=law)
    settings = scene.controller
    wanted = {
        "controller.proportional": settings.proportional * gain / abs(own.gain),
        "controller.assumed_lag_angle": scene.rotor.lag_angle + lag,
    }
    loop = rb.linear_loop(scene.with_values(wanted), flow_law=law)
    assert loop.gain == pytest.approx(gain * np.exp(1j * lag), rel=1e-9)
    assert loop.stable
    assert loop.proportional_alone
    transfer = loop.gain / (CIRCLE - 1.0)
    assert loop.sensitivity_peak == pytest.approx(np.max(np.abs(1 / (1 + transfer))), rel=1e-6)
    disk = np.min(np.abs(2 * (1 + transfer) / (1 - transfer)))
    assert loop.disk_margin == pytest.approx(min(disk, 2.0), rel=1e-6)
    if lag == 0.0:
        assert loop.sensitivity_peak == pytest.approx(2 / (2 - gain))
        assert loop.disk_margin == pytest.approx(2 * (2 - gain) / (2 + gain))


def test_with_integral_and_derivative_matrices_and_transfer_function_agree(
    scene: Scene, law: CompleteLaw
) -> None:
    settings = {"controller.integral_time": "5 s", "controller.derivative_time": "0.05 s"}
    loop = rb.linear_loop(scene.with_values(settings), flow_law=law)
    p, k = loop.plant, loop.controller
    for z in CIRCLE[1000::40_000]:
        plant = p.c @ np.linalg.solve(z * np.eye(2) - p.a, p.b)
        asks = k.c @ np.linalg.solve(z * np.eye(4) - k.a, k.b) + k.d
        opened = plant @ asks
        # The matrix of a complex number c has the eigenvector (1, -j) with the value c.
        turned = opened @ np.array([1.0, -1j])
        transfer = -turned[0]
        shape = 1 + loop.integral / 2 * (z + 1) / (z - 1) + loop.derivative * (1 - 1 / z)
        assert transfer == pytest.approx(loop.gain * shape / (z - 1), rel=1e-9)
    assert not loop.proportional_alone
    assert "keeps its direction" in repr(loop)


EDGE = [
    (0.0, None, 0.0),
    (0.0, None, 0.2),
    (0.0, 2.5, 0.0),
    (0.0, 2.5, 0.06),
    (30.0, None, 0.2),
    (30.0, 2.5, 0.0),
]


@pytest.mark.parametrize(("degrees", "integral_time", "derivative_time"), EDGE)
def test_runs_lose_stability_at_the_printed_gain_margin(
    scene: Scene, law: CompleteLaw, degrees: float, integral_time: float | None, derivative_time: float
) -> None:
    """With integral and derivative too: the amplitude is constant at the edge, reversals reset the sum."""
    wanted = {
        "controller.assumed_lag_angle": scene.rotor.lag_angle + math.radians(degrees),
        "controller.integral_time": integral_time,
        "controller.derivative_time": derivative_time,
        "controller.minimum_gas_time": 0.0,
        "controller.limit": "1 nm",
    }
    asked = scene.with_values(wanted)
    loop = rb.linear_loop(asked, flow_law=law)
    assert loop.margins.gain_factor == pytest.approx(2 * math.cos(math.radians(degrees)) / abs(loop.gain))
    stable = []
    for part in (0.96, 1.04):
        gain = asked.controller.proportional * part * loop.margins.gain_factor
        tried = asked.with_values({"controller.proportional": gain})
        run = simulate(tried, BalancerModel.of(law), modelled=[])
        margins, tried_loop = run.loop.margins, rb.linear_loop(tried, flow_law=law)
        assert margins is not None
        assert margins.sensitivity_peak == pytest.approx(tried_loop.sensitivity_peak, rel=1e-9)
        stable.append((run.settled, tried_loop.stable, margins.stable))
    assert stable == [(True, True, True), (False, False, False)]


@pytest.mark.parametrize("integral_time", [2.5, 48.0])
def test_runs_lose_stability_at_45_degrees_with_an_integral(
    scene: Scene, law: CompleteLaw, integral_time: float
) -> None:
    """However small it is: up to there a residual at the edge turns by 90 deg or more, which resets it."""
    settled = []
    for degrees in (42.0, 52.0):
        wanted = {
            "controller.assumed_lag_angle": scene.rotor.lag_angle + math.radians(degrees),
            "controller.integral_time": integral_time,
            "controller.minimum_gas_time": 0.0,
            "controller.limit": "1 nm",
        }
        tried = scene.with_values(wanted)
        run = simulate(tried, BalancerModel.of(law), modelled=[])
        settled.append((run.settled, rb.linear_loop(tried, flow_law=law).stable))
        alone = tried.with_values({"controller.integral_time": None})
        assert rb.linear_loop(alone, flow_law=law).stable
    assert settled == [(True, True), (False, False)]


def test_margins_of_an_error_of_the_lag_angle() -> None:
    margins = loop_margins(0.5 * np.exp(-0.3j))
    assert margins.gain_factor == pytest.approx(4 * math.cos(0.3))
    assert margins.phase == pytest.approx(math.acos(0.25) - 0.3)
    assert loop_margins(0.5 * np.exp(-0.3j), integral=True).phase == pytest.approx(math.pi / 4 - 0.3)


def test_the_interval_is_that_of_a_correction_at_the_limit(scene: Scene, law: CompleteLaw) -> None:
    tried = scene.with_values({"controller.integral_time": "2.5 s", "controller.gas_time_offset": "0.1 s"})
    loop = rb.linear_loop(tried, flow_law=law)
    interval = 0.5 + 0.1 + scene.controller.proportional * scene.controller.limit
    assert loop.plant.dt == loop.controller.dt == pytest.approx(interval)
    assert loop.integral == pytest.approx(interval / 2.5)


def zone_of(scene: Scene, law: CompleteLaw, gain: float) -> LinearLoop:
    now = abs(rb.linear_loop(scene, flow_law=law).gain)
    wanted = {"controller.proportional": scene.controller.proportional * gain / now}
    return rb.linear_loop(scene.with_values(wanted), flow_law=law)


def test_zones_follow_the_peak(scene: Scene, law: CompleteLaw) -> None:
    """2/(2 - h): 2.5, 3.3, 4.5, 6.7, and no peak of a loop that is unstable."""
    loops = [zone_of(scene, law, gain) for gain in (1.2, 1.4, 1.55, 1.7, 2.1)]
    assert [loop.zone for loop in loops] == ["A", "B", "C", "D", "D"]
    assert [loop.stable for loop in loops] == [True] * 4 + [False]
    assert loops[-1].disk_margin == 0.0


def test_it_prints_its_margins_and_not_its_matrices(scene: Scene, law: CompleteLaw) -> None:
    loop = rb.linear_loop(scene, flow_law=law)
    text = repr(loop)
    assert f"disk margin {loop.disk_margin:.3g}" in text
    assert f"zone {loop.zone}" in text
    assert "stable" in text
    assert "array" not in text
    assert len(text.splitlines()) == 4
    assert f"gain margin {loop.margins.gain_factor:.3g}" in text


def test_python_control_takes_it(scene: Scene, law: CompleteLaw) -> None:
    control = pytest.importorskip("control")
    loop = rb.linear_loop(scene, flow_law=law)
    plant, controller = loop.plant.to_control(), loop.controller.to_control()
    assert plant.input_labels == ["air_time_x", "air_time_y"]
    assert plant.output_labels == ["vibration_x", "vibration_y"]
    page = (Path(__file__).parents[2] / "docs" / "host-python.md").read_text(encoding="utf-8")
    (printed,) = re.findall(r"`(control\.feedback\(.*\))`", page)
    with warnings.catch_warnings():
        # Of NumPy 2.5 about python-control 0.10.2; taken for an error, it makes another class of system.
        warnings.simplefilter("ignore")
        closed = eval(printed, {"control": control, "np": np, "plant": plant, "controller": controller})
    poles = np.sort(np.abs(closed.poles()))
    right = np.sort(np.abs(np.linalg.eigvals(loop.closed)))
    assert poles[-1] == pytest.approx(right[-1], rel=1e-6)


def test_without_python_control_it_is_named(
    monkeypatch: pytest.MonkeyPatch, scene: Scene, law: CompleteLaw
) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ImportError, match="pip install control"):
        rb.linear_loop(scene, flow_law=law).plant.to_control()


def test_a_gain_that_the_scene_does_not_give_is_named(scene: Scene, law: CompleteLaw, tmp_path: Path) -> None:
    """The same disc with no line of the gain: margins are those of 0.08 s/um, and both say so."""
    given = rb.linear_loop(scene, flow_law=law)
    assert (given.findings, given.to_dict()["findings"]) == ((), [])
    text, gains = re.subn(
        r"(?m)^proportional = .*\n", "", rb.bundled_scene("six_chamber").read_text(encoding="utf-8")
    )
    assert gains == 2
    (tmp_path / "bare.toml").write_text(text)
    bare = rb.load_scene(tmp_path / "bare.toml")
    assert isinstance(bare, Scene)
    loop = rb.linear_loop(bare, flow_law=law)
    result = loop.to_dict()
    assert result["disk_margin"] == loop.disk_margin
    assert [(each["code"], each["values"]) for each in result["findings"]] == [
        ("default_gain", {"proportional": pytest.approx(0.08e6)})
    ]
    assert "gives no controller.proportional" in repr(loop)
    assert "default_gain" in {each.code for each in rb.simulate(bare).findings}
    # A gain that a search has put in its place is no default.
    tuned = with_values_at(bare, {"controller.proportional": 0.07e6})
    assert not [*default_gain(tuned)]


def test_another_controller_has_no_linear_loop(scene: Scene, law: CompleteLaw) -> None:
    with pytest.raises(SceneError, match="law_based"):
        rb.linear_loop(scene.with_values({"controller.kind": "law_based"}), flow_law=law)


def test_scenes_of_the_other_balancer_are_refused_in_one_sentence(scene: Scene, law: CompleteLaw) -> None:
    masses: Any = rb.load_scene(rb.bundled_scene("washing_machine"))
    calls: dict[str, Callable[[], object]] = {
        "liquid_ring": lambda: rb.linear_loop(masses, flow_law=law),
        "liquid_ring: its law": lambda: rb.scene_controller(masses),
        "eccentric_mass": lambda: rb.eccentric_loop(cast(Any, scene)),
    }
    for balancer, call in calls.items():
        with pytest.raises(SceneError, match=f"needs a scene of the balancer {balancer}"):
            call()


def test_the_rate_is_that_of_unequal_fills() -> None:
    """The paper's disc cancels 10 um with unequal fills, and its fastest pair is 0.2 % below the product."""
    paper = cast(Scene, rb.load_scene(rb.bundled_scene("liquid_ring_paper")))
    model = BalancerModel.of(rb.calibrate(paper).flow_law)
    level = paper.with_values({"rotor.initial_vibration.amplitude": "1e-6 um"})
    assert loop_rate(paper, model) / loop_rate(level, model) == pytest.approx(0.9981, abs=1e-4)
