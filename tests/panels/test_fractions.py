"""Fractions of the page beside those of the program's own runs: their 95 % bounds meet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
import pytest
from page_modules import in_node, needs_node, panel_content, panel_scene

from ringbalance.controller.balancer import Draws
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, Judgement
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.results.requirements import Proportion

pytestmark = needs_node
KEYS: Final = {
    "gain": "controller.proportional",
    "limit": "controller.limit",
    "pressure": "gas.pressure",
    "amplitude": "rotor.initial_vibration.amplitude",
    "noise": "sensor.amplitude_noise",
}
MANY = """
const numbers = await unpack(content.numbers, content.lengths), settings = sceneSettings(content);
for (const [name, factor] of Object.entries(factors)) settings[name] *= factor;
const { count } = content.designs[0];
const outcomes = [...Array(count).keys()].map((d) => outcomeOf(content, numbers, settings, d, noiseOf(1, d)));
answer = summary(outcomes, content.rules.settlingTime);
"""
PAPER: Final[tuple[Mapping[str, float], ...]] = (
    {},
    {"gain": 2.0},
    {"gain": 0.3},
    {"pressure": 0.7},
    {"amplitude": 1.5},
    {"limit": 2.0},
    {"noise": 3.0},
)
OTHERS: Final[tuple[tuple[str, tuple[Mapping[str, float], ...]], ...]] = (
    ("grinding_spindle", ({}, {"gain": 3.0}, {"gain": 0.3}, {"pressure": 0.7}, {"amplitude": 1.5})),
    ("six_chamber", ({}, {"gain": 2.0}, {"amplitude": 1.5}, {"pressure": 1.4})),
    ("perfluorinated_oil", ({}, {"gain": 2.0}, {"pressure": 0.7})),
    ("silicone_oil_100cst", ({}, {"gain": 2.0})),
)


def assert_bounds_meet(name: str, factors: Mapping[str, float], devices: int) -> None:
    """Compare the page with `tune`'s judgement of the same devices, by the time in which they settle."""
    content = panel_content(name, devices=devices)
    page = in_node(MANY, content=content, factors=factors)
    values = {KEYS[key]: content["ranges"][key][2] * factor for key, factor in factors.items()}
    balancer = LiquidRingBalancer(panel_scene(name).with_values(values))
    outcomes = balancer.run_all([{}], Draws.block(FIRST_VERDICT_DEVICE, devices))[0]
    judgement = Judgement.of(balancer, {}, outcomes)
    program = judgement.fraction_of(judgement.demands[0])
    fraction = Proportion(count=page["count"], of=page["of"])
    assert fraction.of == program.of == devices
    assert max(fraction.low, program.low) <= min(fraction.high, program.high), (fraction, program)


@pytest.mark.parametrize("factors", PAPER[:5], ids=str)
def test_bounds_of_sixteen_devices_meet_those_of_tune(factors: Mapping[str, float]) -> None:
    assert_bounds_meet("liquid_ring_paper", factors, 16)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("name", "factors"),
    [*(("liquid_ring_paper", each) for each in PAPER), *((n, each) for n, some in OTHERS for each in some)],
    ids=str,
)
def test_bounds_of_64_devices_meet_those_of_tune(name: str, factors: Mapping[str, float]) -> None:
    assert_bounds_meet(name, factors, 64)


def test_times_to_settle_are_near_those_of_the_program() -> None:
    """The median of the paper's disc, within a sampling period, as 16 noises of one device allow."""
    content = panel_content("liquid_ring_paper", devices=16)
    page = in_node(MANY, content=content, factors={})
    balancer = LiquidRingBalancer(panel_scene("liquid_ring_paper"))
    outcomes = balancer.run_all([{}], Draws.block(FIRST_VERDICT_DEVICE, 16))[0]
    assert page["half"] == pytest.approx(float(np.sort(outcomes.settling_time)[7]), abs=1.0)
