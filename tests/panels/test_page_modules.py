"""The page's modules in Node: the exported blocks to the last bit, bounds, addresses, copied settings."""

from __future__ import annotations

import math
import random
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, Final

import numpy as np
import pytest
from page_modules import in_node, needs_node, panel_content, panel_scene

from ringbalance.controller.rotor import chamber_letters
from ringbalance.export.blocks import Block, controller_block, disc_block
from ringbalance.panels.content import ranges_of
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.results.requirements import Proportion

pytestmark = needs_node
SAMPLES: Final = 40
PART_S: Final = 0.02
"""Longest step of a watched run, as `PART` of model.js."""

LOOP = """
const numbers = await unpack(content.numbers, content.lengths);
const settings = { ...sceneSettings(content), ...changes };
const run = new Run(content, numbers, settings, { noise: (k) => noise[k] });
while (run.samples < samples) run.advance();
answer = { ...run.trace, lost: lostTime(content, settings) };
"""


@cache
def law_of(name: str) -> CalibratedLaw:
    """Calibrated law of `panel_scene`."""
    return chamber_and_law(panel_scene(name))[1]


def noisy(
    x: float, y: float, deviates: tuple[float, float], noise: float, phase_noise: float
) -> tuple[float, float]:
    """A reading with noise, in the order of operations of the page."""
    size, half = math.sqrt(x * x + y * y), deviates[1] * phase_noise / 2
    square = half * half
    cosine, sine = (1 - square) / (1 + square), 2 * half / (1 + square)
    factor = abs(size + deviates[0] * noise) / size if size > 0 else 1.0
    return factor * (x * cosine - y * sine), factor * (x * sine + y * cosine)


def looped(
    disc: Block, controller: Block, noise: list[tuple[float, float]], lost: float, sigma: tuple[float, float]
) -> Iterator[tuple[float, float, float]]:
    """Time and vibration of the exported blocks in a loop, after each step."""
    letters = [each.name[-1] for each in disc.variables if each.name.startswith("fill_ratio_")]
    plant, memory, time, part, samples = list(disc.start), list(controller.start), 0.0, 0.0, 0
    seen = disc.run(plant, 0.0, {})
    yield time, seen["vibration_x"], seen["vibration_y"]
    while samples < SAMPLES:
        x, y = noisy(seen["vibration_x"], seen["vibration_y"], noise[samples], *sigma)
        command = controller.run(memory, part, {"vibration_x": x, "vibration_y": y})
        samples, part = int(command["samples"]), min(command["wait"], PART_S)
        opened = {f"open_time_{each}": max(command[f"open_time_{each}"] - lost, 0.0) for each in letters}
        seen, time = disc.run(plant, part, opened), time + part
        yield time, seen["vibration_x"], seen["vibration_y"]


@pytest.mark.parametrize(
    ("name", "kind", "mass"),
    [
        ("liquid_ring_paper", "target_vector", True),
        ("liquid_ring_paper", "target_vector", False),
        ("liquid_ring_paper", "law_based", True),
        ("six_chamber", "trial", True),
        ("grinding_spindle", "target_vector", True),
        pytest.param("liquid_ring_paper", "law_based", False, marks=pytest.mark.heavy),
        pytest.param("six_chamber", "trial", False, marks=pytest.mark.heavy),
        pytest.param("grinding_spindle", "target_vector", False, marks=pytest.mark.heavy),
    ],
)
def test_a_run_has_the_bits_of_the_exported_blocks_in_a_loop(name: str, kind: str, mass: bool) -> None:
    """With noise from a stored table, and shortened injections or not."""
    content, scene = panel_content(name), panel_scene(name)
    random_numbers = np.random.default_rng(3).standard_normal((SAMPLES + 1, 2))
    noise = [(a, b) for a, b in random_numbers.tolist()]
    changes = {"algorithm": kind, "mass": mass}
    answer = in_node(LOOP, content=content, noise=noise, changes=changes, samples=SAMPLES)
    assert (answer["lost"] > 0.0) <= mass

    law = law_of(name)
    disc, controller = (
        disc_block(scene, law),
        controller_block(scene.with_values({"controller.kind": kind}), law),
    )
    sigma = scene.sensor.amplitude_noise, scene.sensor.phase_noise
    rows = list(looped(disc, controller, noise, answer["lost"], sigma))
    assert len(rows) > SAMPLES
    for at, key in enumerate(("time", "x", "y")):
        assert answer[key] == [row[at] for row in rows], key


@pytest.mark.parametrize(
    ("setting", "value", "path"),
    [
        ("gain", 2.0, "controller.proportional"),
        ("limit", 3.0, "controller.limit"),
        ("amplitude", 1.5, "rotor.initial_vibration.amplitude"),
        ("pressure", 1.4, "gas.pressure"),
    ],
)
def test_a_control_does_what_the_scenes_key_does(setting: str, value: float, path: str) -> None:
    """The same run as that of a scene with the changed value; least fills are rounded to 1e-6."""
    scene, content = panel_scene("liquid_ring_paper"), panel_content("liquid_ring_paper")
    changed = content["ranges"][setting][2] * value
    noise = [[0.0, 0.0]] * (SAMPLES + 1)
    answer = in_node(
        LOOP, content=content, noise=noise, changes={setting: changed, "mass": False}, samples=12
    )
    other, law = scene.with_values({path: changed}), law_of("liquid_ring_paper")
    rows = list(looped(disc_block(other, law), controller_block(other), [(0.0, 0.0)] * 99, 0.0, (0.0, 0.0)))
    count = len(answer["time"])
    assert count > 30
    x, y = np.array([row[1:] for row in rows[:count]]).T
    largest = float(np.max(np.hypot(x, y)))
    assert np.array(answer["x"]) == pytest.approx(x, abs=1e-5 * largest)
    assert np.array(answer["y"]) == pytest.approx(y, abs=1e-5 * largest)


def test_a_step_of_load_moves_the_vibration_by_its_vector() -> None:
    script = """
    const numbers = await unpack(content.numbers, content.lengths), settings = sceneSettings(content);
    const [plain, loaded] = [[], [{ time: 0.1, x: 3e-6, y: -1e-6 }]].map((loads) => {
      const run = new Run(content, numbers, settings, { loads });
      while (run.time < 0.099) run.advance();
      return run;
    });
    plain.advance(); loaded.advance();
    answer = [loaded.x - plain.x, loaded.y - plain.y];
    """
    assert in_node(script, content=panel_content("liquid_ring_paper")) == pytest.approx(
        [3e-6, -1e-6], abs=1e-18
    )


def test_a_load_after_the_end_begins_a_new_judgement() -> None:
    """The run goes on as one with the same load from the start of it, and settles again after the load."""
    script = """
    const numbers = await unpack(content.numbers, content.lengths), settings = sceneSettings(content);
    const run = new Run(content, numbers, settings);
    while (!run.ended) run.advance();
    const [end, first] = [run.time, run.ended];
    run.addLoad(3e-6, -1e-6);
    const [ended, loaded] = [run.ended, run.amplitude > run.limit];
    while (!run.ended) run.advance();
    const again = new Run(content, numbers, settings, { loads: run.loads });
    while (again.time < run.time) again.advance();
    answer = { end, first, ended, loaded, settled: run.settled, x: run.x, again: [again.settled, again.x] };
    """
    answer = in_node(script, content=panel_content("liquid_ring_paper"))
    assert (answer["first"], answer["ended"], answer["loaded"]) == ("settled", "", True)
    assert answer["settled"] > answer["end"]
    assert answer["again"] == [answer["settled"], answer["x"]]


def test_a_cause_names_a_lower_pressure_only_where_it_helps() -> None:
    """By the least fills of one device: emptied at the scene's pressure, cured by a lower one, or by none."""
    script = """
    const numbers = await unpack(content.numbers, content.lengths), settings = sceneSettings(content);
    answer = fills.map(([stall, residual]) => {
      content.devices[0].least = [stall, residual];
      const run = new Run(content, numbers, settings);
      run.ended = "time_limit";
      return run.outcome;
    });
    """
    content = panel_content("liquid_ring_paper")
    low, high = 8 * [0.0], 8 * [1.0]
    assert content["pressures"][4] == content["ranges"]["pressure"][2]
    cured = [*low[:4], *high[4:]]
    weaker = [*high[:5], *low[5:]]
    fills = [[low, low], [high, high], [cured, cured], [high, low], [weaker, high]]
    assert in_node(script, content=content, fills=fills) == [
        "time_limit",
        "capacity_exceeded",
        "emptied",
        "stalled",
        "capacity_exceeded",
    ]


def test_bounds_are_those_of_tune() -> None:
    pairs = [(0, 16), (5, 16), (16, 16), (53, 64), (64, 64), (1, 1), (0, 0)]
    for (count, of), ends in zip(
        pairs, in_node("answer = pairs.map(([a, b]) => bounds(a, b));", pairs=pairs), strict=True
    ):
        proportion = Proportion(count=count, of=of)
        assert ends == pytest.approx([proportion.low, proportion.high], abs=1e-15)


def test_verdicts_on_fractions_are_those_of_tune() -> None:
    pairs = [(16, 16), (64, 64), (63, 64), (53, 64), (40, 64), (0, 16)]
    script = """
    answer = pairs.map((pair) => {
      const [low, high] = bounds(...pair);
      return verdict({ low, high }, 0.9);
    });
    """
    expected = [Proportion(count=count, of=of).verdict(0.9) for count, of in pairs]
    assert in_node(script, pairs=pairs) == expected
    assert set(expected) == {"met", "undecided", "not met"}


def test_noise_of_the_page_is_standard_normal() -> None:
    """Mean, variance and correlation of 20,000 pairs within five standard deviations; no pair twice."""
    script = """
    const pairs = [1, 2, 77].map((seed) => Array.from({ length: 20000 }, (_, k) => normalPairs(seed)(k)));
    answer = pairs;
    """
    for pairs in np.array(in_node(script)):
        n = len(pairs)
        assert np.abs(pairs.mean(axis=0)) == pytest.approx(0.0, abs=5 / math.sqrt(n))
        assert pairs.var(axis=0) == pytest.approx(1.0, abs=5 * math.sqrt(2 / n))
        for a, b in ((pairs[:, 0], pairs[:, 1]), (pairs[1:, 0], pairs[:-1, 0])):
            assert np.corrcoef(a, b)[0, 1] == pytest.approx(0.0, abs=5 / math.sqrt(n))
        assert np.mean(np.abs(pairs) > 2) == pytest.approx(
            math.erfc(math.sqrt(2)), abs=5 * math.sqrt(0.05 / n)
        )
        assert len({tuple(each) for each in pairs.tolist()}) == n


STATES = """
const scene = sceneSettings(content);
answer = addresses.map((address) => read(address, content, scene));
answer = answer.map((state) => [state, written(state, scene)]);
"""


def test_an_address_gives_back_its_state_and_nothing_else_is_taken() -> None:
    content = panel_content("liquid_ring_paper")
    kept = "gain=0.16&integral=none&algorithm=law_based&valve=0&device=3&seed=7&speed=20&load=2.5,3,-1"
    refused = (
        "gain=1e5&gain=-1&gain=&valve=3&valve=0.5&design=1&device=99&seed=0&speed=3&algorithm=__proto__&"
        "load=1,2&load=1,2,3,4&load=-1,1,1&load=1,900,0&constructor=1&__proto__=1&<script>=1&a=b=c&=&&mass=2"
    )
    (state, text), (plain, nothing), (again, _) = in_node(
        STATES, content=content, addresses=[kept, refused, kept]
    )
    assert text.split("&") == sorted(kept.split("&"), key=text.split("&").index)
    assert state["settings"]["gain"] == pytest.approx(0.16e6)
    assert state["settings"]["integral"] is None
    assert (state["device"], state["seed"], state["speed"]) == (2, 7, 20)
    assert state["loads"] == [{"time": 2.5, "x": pytest.approx(3e-6), "y": pytest.approx(-1e-6)}]
    assert nothing == ""
    assert again == state
    assert plain["settings"]["gain"] == content["ranges"]["gain"][2]


def test_fuzzed_addresses_stay_within_the_ranges() -> None:
    content, source = panel_content("liquid_ring_paper"), random.Random(1)
    names = [
        *content["ranges"],
        "algorithm",
        "valve",
        "design",
        "device",
        "seed",
        "speed",
        "load",
        "toString",
    ]
    signs = "0123456789.-,eE+=&#%<>\"'\\none\u2028"
    addresses = [
        "&".join(
            f"{source.choice(names)}={''.join(source.choices(signs, k=source.randint(0, 12)))}"
            for _ in range(5)
        )
        for _ in range(2000)
    ]
    taken = 0
    for state, _ in in_node(STATES, content=content, addresses=addresses):
        for name, (low, high, _value) in content["ranges"].items():
            value = state["settings"][name]
            assert value is None or low * 0.998 <= value <= high * 1.002
            taken += value != content["ranges"][name][2]
        assert set(state["settings"]) == {*content["ranges"], "algorithm", "valve", "design", "mass"}
        assert state["settings"]["valve"] in (-1, 0)
    assert taken > 100


def test_copied_settings_are_blocks_that_the_scene_takes() -> None:
    changes: Mapping[str, Any] = {
        "gain": 0.16e6,
        "integral": 5.0,
        "pressure": 0.5e6,
        "valve": 0,
        "phase": 1.0,
    }
    script = """
    const scene = sceneSettings(content);
    answer = [sceneBlocks(content, { ...scene, ...changes }, scene), sceneBlocks(content, scene, scene)];
    """
    scene = panel_scene("liquid_ring_paper")
    text, unchanged = in_node(script, content=panel_content("liquid_ring_paper"), changes=changes)
    values = {
        f"{table}.{key}": value for table, keys in tomllib.loads(text).items() for key, value in keys.items()
    }
    changed = scene.with_values(values)
    assert changed.controller.proportional == pytest.approx(0.16e6)
    assert changed.controller.integral_time == 5.0
    assert changed.gas.pressure == pytest.approx(0.5e6)
    assert changed.gas.valve_lag == pytest.approx(5e-3)
    assert changed.rotor.initial_phase == pytest.approx(1.0)
    assert changed.rotor.initial_amplitude == scene.rotor.initial_amplitude
    assert tomllib.loads(unchanged) == {}


def test_a_slider_gives_back_what_it_shows() -> None:
    ranges = ranges_of(panel_scene("liquid_ring_paper"), panel_content("liquid_ring_paper")["valves"])
    script = """
    answer = Object.entries(ranges).map(([name, range]) => [0, 137, 500, 999].map((step) => {
      const value = valueAt(CONTROLS[name], range, step);
      return Math.abs(stepOf(CONTROLS[name], range, value) - step);
    }));
    """
    # Values are rounded to three digits, a thousandth of a decade or more.
    assert np.max(in_node(script, ranges=ranges)) < 5


def test_the_drawn_liquid_has_the_area_of_its_fill() -> None:
    answer = in_node("answer = [0, 0.1, 0.25, 0.5, 1].map((fill) => surfaceRadius(20, 44, fill));")
    assert [44**2 - s**2 for s in answer] == pytest.approx(
        [f * (44**2 - 20**2) for f in (0, 0.1, 0.25, 0.5, 1)]
    )


def test_letters_of_the_page_are_those_of_the_chambers() -> None:
    content = panel_content("six_chamber")
    names = {name for name in content["places"]["row"] if name.startswith("fill_ratio_")}
    assert names == {f"fill_ratio_{letter.lower()}" for letter in chamber_letters(6)}
