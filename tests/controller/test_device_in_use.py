"""Drawn devices that leak, whose sensor has a runout or whose liquid has become less, in an own plant too.

The fractions that settle in time are compared as in test_own_plant: zero lies within the 95 % interval of
their difference. Both sides have the settings of the scene.
"""

from __future__ import annotations

import cmath
import math
from typing import Final

import numpy as np
import pytest
from own_draws import drawn
from own_plant import Share, run, settings_of

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.scene.models import Scene
from scenes import bundled

SEED: Final = 29
SPINDLE, PAPER = "grinding_spindle", "liquid_ring_paper"
TUNED: Final[dict[str, object]] = {
    "gas.pressure": "0.526 MPa",
    "controller.proportional": "0.0808 s/um",
    "controller.integral_time": "5 s",
    "controller.gas_time_offset": "2.3 ms",
}
LEAK: Final = "gas.leak_to_ambient"
RUNOUT: Final[dict[str, object]] = {"sensor.runout": {"amplitude": "1 um"}}


def less(lost: float) -> dict[str, object]:
    """Chambers that have lost a part of their liquid."""
    return {"disc.max_fill_ratio": 0.5 * (1 - lost), "disc.initial_fill": 0.25 * (1 - lost)}


LIGHT: Final[dict[str, tuple[str, dict[str, object]]]] = {
    "paper's disc, 20 % less liquid": (PAPER, TUNED | less(0.2)),
}
HEAVY: Final[dict[str, tuple[str, dict[str, object]]]] = LIGHT | {
    "spindle, 0.1 l/(s bar) leak": (SPINDLE, {LEAK: "0.1 l/(s*bar)"}),
    "spindle, 0.2 l/(s bar) leak": (SPINDLE, {LEAK: "0.2 l/(s*bar)"}),
    "spindle, 1 um of runout": (SPINDLE, RUNOUT),
    "spindle, 10 % less liquid": (SPINDLE, less(0.1)),
    "spindle, 20 % less liquid": (SPINDLE, less(0.2)),
    "paper's disc, 10 % less liquid": (PAPER, TUNED | less(0.1)),
}


def own_settling_times(scene: Scene, *, count: int) -> list[float]:
    settings = settings_of(scene, offset=scene.controller.offsets(scene.disc.chambers)[0])
    turns = np.random.default_rng(SEED).uniform(0.0, 2 * math.pi, count).tolist()
    amplitude = scene.sensor.runout_amplitude or 0.0
    return [
        run(
            drawn(scene, number=i, seed=SEED),
            settings,
            noise_seed=SEED + i,
            runout=cmath.rect(amplitude, turn),
        ).settling_time
        for i, turn in enumerate(turns)
    ]


def check(name: str, values: dict[str, object], *, count: int) -> None:
    scene = bundled(name, values | {"controller.kind": "target_vector"})
    (judged,) = judged_all(balancer_of(scene), [{}], most=4 * count)
    settles = judged.fraction_of(judged.demands[0])
    # Infinite where a device does not settle.
    limit = scene.requirement.settling_time or np.finfo(float).max
    own = Share.of(np.array(own_settling_times(scene, count=count)) <= limit)
    assert Share(settles.value, settles.low, settles.high).agrees(own), (settles, own)


@pytest.mark.parametrize(("name", "values"), LIGHT.values(), ids=LIGHT)
def test_fractions_of_devices_in_use_are_those_of_an_own_plant(name: str, values: dict[str, object]) -> None:
    check(name, values, count=48)


@pytest.mark.heavy
@pytest.mark.parametrize(("name", "values"), HEAVY.values(), ids=HEAVY)
def test_fractions_of_many_devices_in_use_are_those_of_an_own_plant(
    name: str, values: dict[str, object]
) -> None:
    check(name, values, count=64)
