"""The page that replays runs with eccentric masses: numbers of the runs, state in the address, size."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from page_modules import in_node, needs_node

import ringbalance as rb
from ringbalance.controller.balancer import Draws
from ringbalance.controller.eccentric_mass.balancer import EccentricMassBalancer
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE
from ringbalance.panels.document import REPLAY_MODULES, document_of
from ringbalance.panels.replay import DEVICES, replay_content

MOST_BYTES = 300_000
"""As of every panel: it is sent by mail."""


@cache
def scene() -> EccentricScene:
    """Twelve seconds, in which the masses balance the rotor."""
    driven = rb.load_scene(rb.bundled_scene("driven_masses_small"))
    return cast(EccentricScene, driven.with_values({"run.time_limit": "12 s"}))


@cache
def content() -> dict[str, Any]:
    return replay_content(scene(), devices=2)


@cache
def drawn_run() -> EccentricRun:
    """Run of the second drawn device, the third of the page."""
    draws = Draws.block(FIRST_VERDICT_DEVICE + 1, 1)
    return cast(EccentricRun, EccentricMassBalancer(scene()).run({}, draws, trace=True).traced[0].run)


@needs_node
def test_a_replayed_run_is_the_program_s() -> None:
    """Between instants on a line, within a twentieth of the vibration or of the limit, and half a degree."""
    run = drawn_run()
    samples = np.arange(0, len(run.time), 37)
    answer = in_node(
        """
        const run = (await unpackRuns(content))[2];
        answer = times.map((time) => stateAt(run, time));
        """,
        content=content(),
        times=run.time[samples].tolist(),
    )
    whirl = np.array([state["x"] + 1j * state["y"] for state in answer])
    size = np.maximum(np.abs(run.whirl[samples]), run.limit)
    # A picture of 300 pixels over three decades shows 5 % as 2 pixels.
    assert np.abs(whirl - run.whirl[samples]).max() <= 0.05 * size.max()
    assert np.quantile(np.abs(whirl - run.whirl[samples]) / size, 0.99) <= 0.05
    angles = np.array([state["angles"] for state in answer]).T
    assert np.abs(angles - run.mass_angle[:, samples]).max() <= np.radians(0.5)
    starts = np.array([stage.start for stage in run.stages])
    clear = np.abs(run.time[samples][:, None] - starts).min(axis=1) > run.scene.sensor.step
    names = [run.stages[i].name for i in np.searchsorted(starts, run.time[samples], side="right") - 1]
    assert [s["stage"] for s, c in zip(answer, clear, strict=True) if c] == [
        name for name, c in zip(names, clear, strict=True) if c
    ]


@needs_node
def test_the_largest_torque_and_vibration_of_a_run_are_kept() -> None:
    """Torque on a mass from the motor's equations: n K_i (V - K_m n phi')/R_m."""
    run, motor = drawn_run(), drawn_run().scene.motor
    ratio = motor.teeth[2] / motor.teeth[0]
    current = (run.voltage - motor.back_emf_constant * ratio * run.mass_rate) / motor.resistance
    torque = ratio * motor.torque_constant * current
    answer = in_node(
        """
        const run = (await unpackRuns(content))[2];
        const amplitudes = run.x.map((x, i) => Math.hypot(x, run.y[i]));
        answer = [run.torques.map((each) => Math.max(...each.map(Math.abs))), Math.max(...amplitudes)];
        """,
        content=content(),
    )
    # Half precision has eleven bits.
    assert answer[0] == pytest.approx(np.abs(torque).max(axis=1), rel=2**-11)
    assert answer[1] == pytest.approx(run.worst_amplitude, rel=2**-10)


@needs_node
def test_half_precision_is_read_as_numpy_writes_it() -> None:
    bits = list(range(0, 0x7C00, 7)) + list(range(0x8000, 0xFC00, 7))
    expected = np.array(bits, dtype=np.uint16).view(np.float16).astype(float)
    assert in_node("answer = bits.map(halfPrecision);", bits=bits) == expected.tolist()


@needs_node
def test_moments_of_balanced_masses_oppose_the_unbalance() -> None:
    """A kept run ends balanced: what is drawn as the sum of both masses is what the unbalance needs."""
    answer = in_node(
        """
        const run = (await unpackRuns(content))[0], end = stateAt(run, run.end);
        answer = moments({ ...end, moment: run.moment, unbalance: run.unbalance });
        """,
        content=content(),
    )
    unbalance, masses = (np.array(answer[name]) for name in ("unbalance", "masses"))
    plant = PlantParameters.of(scene())
    assert np.hypot(*unbalance) == pytest.approx(plant.unbalance)
    residual = scene().supervisor.limit / abs(plant.influence(scene().rotor.profile[1][0]))
    assert np.hypot(*(unbalance + masses)) <= residual


@needs_node
def test_the_state_is_in_the_address_and_nothing_else_is() -> None:
    texts = ["", "device=2&time=3.25&speed=60", "device=1", "time=99999"]
    wrong = [
        "device=3",
        "device=-1",
        "device=1.5",
        "speed=3",
        "time=1e3",
        "time=<b>",
        "x=1",
        "device",
        "=" * 999,
    ]
    answer = in_node(
        """
        const runs = await unpackRuns(content);
        const again = (text) => replayAddress(replayState("#" + text, runs));
        answer = [texts.map(again), wrong.map(again)];
        """,
        content=content(),
        texts=texts,
        wrong=wrong,
    )
    assert answer == [["", texts[1], texts[2], "time=12"], [""] * len(wrong)]


@needs_node
def test_instants_profiles_and_stages() -> None:
    answer = in_node(
        """
        const run = { time: [0, 1, 1, 3], stages: [["a", 0], ["b", 1], ["c", 1], ["d", 3]] };
        answer = [
          [-1, 0, 0.9, 1, 2, 9].map((time) => instantAt(run, time)),
          [0, 1, 3].map((time) => stageAt(run, time)),
          stageMarks(run, 2).map(({ label }) => label),
          [-1, 0, 5, 10, 15, 20, 30].map((time) => profileAt([[0, 10, 20], [1, 1, 3]], time)),
        ];
        """
    )
    assert answer == [[0, 0, 0, 2, 2, 3], ["a", "c", "d"], ["c"], [1, 1, 1, 1, 2, 3, 3]]


def test_the_page_of_all_devices_is_small() -> None:
    """Longer runs have as many instants; numbers that do not repeat are packed worst."""
    few = content()
    text = document_of(few, page="replay.html", modules=REPLAY_MODULES)
    of_devices = len(few["numbers"]) / 4 * (DEVICES + 2)
    assert len(text) - len(few["numbers"]) + of_devices <= MOST_BYTES


def test_a_scene_with_eccentric_masses_has_a_panel(tmp_path: Path) -> None:
    page = rb.panel(scene().with_values({"run.time_limit": "0.2 s"}))
    written = page.save(tmp_path / "panel.html").read_text(encoding="utf-8")
    packed = json.loads(written.split('id="content">')[1].split("</script>")[0])
    assert len(packed["runs"]) == DEVICES + 2
    assert "connect-src" not in written
