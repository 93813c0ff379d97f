"""Results that leave the process or stand in a notebook, and algorithms, sensors and laws of one's own."""

from __future__ import annotations

import cmath
import copy
import json
import math
import pickle
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from short_answers import answer, driven, short

import ringbalance as rb
from ringbalance import face
from ringbalance.scene.narrowing import liquid_ring_scene

LONGEST_TEXT = 12
"""Lines; statuses take what they need on one."""


ANSWERS = (
    *("scene", "eccentric scene", "calibration", "law", "paper's law", "run", "eccentric run"),
    *("tuning", "fit", "comparison"),
)


@pytest.mark.parametrize("name", ANSWERS)
def test_answers_pickle_copy_and_print_shortly(name: str) -> None:
    result = answer(name)
    text = repr(result)
    assert 2 <= len(text.splitlines()) <= LONGEST_TEXT
    assert len(text) < 1500
    for again in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert repr(again) == text
        if hasattr(result, "to_dict"):
            assert json.dumps(again.to_dict()) == json.dumps(result.to_dict())


def test_a_pool_gives_calibrations_back() -> None:
    scenes = [short().with_values({"tube.bore": bore}) for bore in ("1.4 mm", "1.6 mm")]
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        calibrations = list(pool.map(rb.calibrate, scenes))
    for scene, calibration in zip(scenes, calibrations, strict=True):
        assert calibration.to_dict() == rb.calibrate(scene).to_dict()


def test_what_tune_recommends_is_a_scene_that_runs() -> None:
    tuning = answer("tuning")
    scene = liquid_ring_scene(tuning.recommended_scene)
    assert scene.controller == tuning.scene.controller
    assert scene.sha256 != short().sha256
    assert scene.origin_of("controller.proportional") == "inferred"
    assert rb.simulate(scene, flow_law=rb.paper_law(scene)).scene == scene


@pytest.mark.parametrize("pressure", [True, False])
def test_a_search_over_the_pressure_is_an_option(monkeypatch: pytest.MonkeyPatch, pressure: bool) -> None:
    monkeypatch.setattr(face, "tuned", lambda _, **options: options)
    options: Any = rb.tune(short(), flow_law=rb.paper_law(short()), pressure=pressure)
    assert options["scan"] is pressure


class Wrapped:
    """The scene's own algorithm under another name."""

    def __init__(self, weaker: float) -> None:
        settings = {"controller.proportional": short().controller.proportional * weaker}
        self.inner = rb.scene_controller(liquid_ring_scene(short().with_values(settings)))
        self.rises_tolerated = self.inner.rises_tolerated

    def start(self) -> Any:
        return self.inner.start()

    def step(self, state: Any, measurement: rb.Measurement | None) -> tuple[Any, rb.Command]:
        return self.inner.step(state, measurement)


def test_an_algorithm_of_one_s_own_runs_and_is_named() -> None:
    law = rb.paper_law(short())
    user_run = rb.simulate(short(), flow_law=law, controller=Wrapped(1.0))
    usual = answer("run")
    np.testing.assert_array_equal(user_run.amplitude, usual.amplitude[: user_run.amplitude.size])
    assert user_run.to_dict()["controller"] == "Wrapped"
    assert user_run.to_dict()["gas_line_runs"] == []
    assert usual.to_dict()["controller"] == "target_vector"


def test_a_sensor_of_one_s_own_is_what_the_algorithm_sees() -> None:
    times: list[float] = []

    def twice(time: float, vibration: complex) -> rb.Measurement:
        return rb.Measurement(time=time, amplitude=2 * abs(vibration), phase=cmath.phase(vibration))

    run = rb.simulate(
        short(),
        flow_law=rb.paper_law(short()),
        sensor=twice,
        progress=lambda time, limit: times.append(time / limit),
    )
    first = run.samples[0].measurement
    assert first is not None
    assert first.amplitude == pytest.approx(2 * run.amplitude[0], rel=1e-12)
    assert times == sorted(times)
    assert times[0] == 0.0
    assert math.isclose(times[-1] * 6, run.samples[-1].time)


class Slower:
    """The calibrated law with a part of its velocity."""

    name = "calibrated"

    def __init__(self, part: float) -> None:
        self.law, self.part = rb.calibrate(short()).flow_law, part

    def evaluate(self, **conditions: Any) -> rb.Flow:
        flow = self.law.evaluate(**conditions)
        return replace(flow, velocity=self.part * flow.velocity)


class Short:
    """A law of one's own that forgets the arrays."""

    def __init__(self, answer: Any) -> None:
        self.answer = answer

    def evaluate(self, **_conditions: Any) -> Any:
        return self.answer


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (1.5, r"Short returns a Flow, not 1\.5"),
        (
            SimpleNamespace(velocity=1.0, uncertainty=0.1, regime=1, primed=True),
            "all arrays of its Flow have the shape of the conditions",
        ),
    ],
)
def test_a_law_that_gives_no_arrays_is_refused_in_one_sentence(answer: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        rb.simulate(short(), flow_law=Short(answer))


def test_what_a_law_of_one_s_own_does_not_give_is_said() -> None:
    law = rb.calibrate(short()).flow_law
    alone = rb.simulate(short(), flow_law=law, modelled=[])
    user_run = rb.simulate(short(), flow_law=Slower(1.0))
    assert user_run.model.moment is not None
    assert user_run.law == "Slower"
    np.testing.assert_allclose(user_run.amplitude[-1], alone.amplitude[-1], rtol=0.05, atol=1e-8)
    unmodelled = {row.term for row in user_run.models_used if "no forces" in row.why}
    assert "tube inertia" in unmodelled
    for word in (*unmodelled, "moment", "chamber_volume", "density"):
        assert word in user_run.status
    half = rb.simulate(short(), flow_law=Slower(0.5))
    rates = [run.to_dict()["vibration_rate_m_per_s"] for run in (half, user_run)]
    assert rates[0] == pytest.approx(rates[1] / 2, rel=1e-9)
    with pytest.raises(TypeError, match="evaluate"):
        rb.simulate(short(), flow_law=object())  # type: ignore[call-overload]


def test_eccentric_masses_have_their_own_strategy_and_both_are_tuned(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="controller"):
        rb.simulate(driven(), controller=Wrapped(1.0))  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="step"):
        rb.simulate(short(), controller=3)  # type: ignore[call-overload]
    locked = driven().with_values({"supervisor.strategy": "locked"})
    tuning = rb.tune(locked)
    assert tuning.scene.supervisor.strategy == "locked"
    assert not tuning.succeeded
    with pytest.raises(rb.SceneError):
        rb.fit(short(), tmp_path / "none.csv")
