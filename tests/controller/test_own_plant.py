"""The program's fractions of drawn devices against those of a plant and of draws that are none of its own.

Limits are those of what was asked of the program, set before either side was run. Fractions agree where zero
lies within the 95 % interval of their difference (Newcombe's method 10, from both Wilson intervals).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
import pytest
from own_draws import drawn
from own_plant import Share, run, settings_of, settling_times

import ringbalance
from ringbalance.controller.balancer import AS_GIVEN, Draws, Outcomes, balancer_of
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.judging.tune import tuned
from ringbalance.results.requirements import MET, MISSED
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import with_values_at
from scenes import bundled, with_tables

ASKED: Final = 0.9
SEED: Final = 29
OFFSET: Final = {"controller.gas_time_offset": (1.2e-3,)}
VALVE: Final = {"gas.conductance": "1 l/(s*bar)", "gas.critical_ratio": 0.3, "gas.valve_lag": "5 ms"}
LOW: Final = {"gas.pressure": "0.42 MPa"}
PAPER, SIX, CALIBRATED = "liquid_ring_paper", "six_chamber", "liquid_ring_paper_calibrated"


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """The scene in the README."""
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    file = tmp_path_factory.mktemp("readme") / "my_disc.toml"
    file.write_text(readme.partition("```toml")[2].partition("```")[0])
    return cast("Scene", ringbalance.load_scene(file))


def own(scene: Scene, count: int, *, offset: float = 0.0) -> Share:
    settings = settings_of(scene, offset=offset)
    return Share.of(np.isfinite(settling_times(scene, settings, numbers=count, seed=SEED)))


def outcomes(scene: Scene, count: int, *, offset: float = 0.0) -> Outcomes:
    setting = {"controller.gas_time_offset": (offset,)} if offset else {}
    return balancer_of(scene).run_all([setting], Draws.first(count))[0]


def both(scene: Scene, count: int, *, offset: float = 0.0) -> tuple[Share, Share]:
    """The program's fraction and that of the own plant."""
    return Share.of(outcomes(scene, count, offset=offset).settled), own(scene, count, offset=offset)


# (scene, values, offset in s, draws), and between which bounds the fraction is to lie.  Six chambers with a
# valve settle at an offset of 15 ms in 295 of 320 in the program and 300 in the own plant, of the first 64 in
# 58 and 64.  Of six chambers at their own gain a further plant with other correlations settles 957 to 979 of
# 1,000.  At 0.42 MPa every device stalls in its first seconds, in either plant: 20 s show it, and the heavy
# ones wait the scene's 120 s.
LIGHT: Final = {
    "paper's disc at 0.42 MPa": (PAPER, LOW | {"run.time_limit": "20 s"}, 0.0, 32, 0.0, 0.02),
    "paper's disc at 0.70 MPa": (PAPER, {}, 0.0, 128, 0.80, 0.88),
    "six chambers at their own gain": (SIX, {}, 0.0, 128, 0.95, 0.98),
    "six chambers with a valve": (SIX, VALVE, 17e-3, 64, 0.0, 1.0),
}
HEAVY: Final = {
    "paper's disc at 0.42 MPa": (PAPER, LOW, 0.0, 32, 0.0, 0.02),
    "paper's disc at 0.56 MPa": (PAPER, {"gas.pressure": "0.56 MPa"}, 1.2e-3, 256, 0.9, 1.0),
    "paper's disc at 0.70 MPa": (PAPER, {}, 0.0, 512, 0.80, 0.88),
    "six chambers at their own gain": (SIX, {}, 0.0, 512, 0.95, 0.98),
    "six chambers with an offset": (SIX, {}, 2e-3, 256, 0.97, 1.0),
    "six chambers with a valve": (SIX, VALVE, 17e-3, 128, 0.0, 1.0),
    "six chambers with a valve, 15 ms": (SIX, VALVE, 15e-3, 320, 0.0, 1.0),
    "narrow tube with a valve": (CALIBRATED, VALVE, 30e-3, 128, 0.0, 1.0),
    "paper's disc with a valve": (PAPER, VALVE, 20e-3, 128, 0.0, 1.0),
}


def check(case: tuple[str, dict[str, object], float, int, float, float]) -> None:
    name, values, offset, count, low, high = case
    theirs, mine = both(bundled(name, values), count, offset=offset)
    assert theirs.agrees(mine), (theirs, mine)
    for share in (theirs, mine):
        assert share.low <= high, (theirs, mine)
        assert share.high >= low, (theirs, mine)


@pytest.mark.parametrize("case", LIGHT.values(), ids=LIGHT)
def test_fractions_are_those_of_an_own_plant(
    case: tuple[str, dict[str, object], float, int, float, float],
) -> None:
    check(case)


@pytest.mark.heavy
@pytest.mark.parametrize("case", HEAVY.values(), ids=HEAVY)
def test_fractions_of_many_draws_are_those_of_an_own_plant(
    case: tuple[str, dict[str, object], float, int, float, float],
) -> None:
    check(case)


def test_a_crest_decides_whether_a_correction_lasts(shown: Scene) -> None:
    """At 31.5 mm nine in ten settle with one offset for all chambers, at 40 mm none."""
    theirs, mine = both(shown, 64, offset=0.5e-3)
    assert min(theirs.low, mine.low) >= ASKED, (theirs, mine)
    deep = shown.with_values({"tube.hump_radius": "40 mm"})
    theirs, mine = both(deep, 8)
    assert theirs.value == mine.value == 0.0


@pytest.mark.parametrize(("name", "values"), [(SIX, {}), (PAPER, {"gas.pressure": "0.55 MPa"})])
def test_a_loop_that_goes_on_trying_settles(name: str, values: dict[str, object]) -> None:
    """Commands too short to move liquid end no run: the integral grows, and noise moves what rests just above
    the limit, so that the devices that judge all settle within seconds, as those of an own plant do."""
    scene = bundled(name, values)
    result = judged_all(balancer_of(scene), [{}], most=64)[0].outcomes
    assert set(result.ended) == {"settled"}
    assert own(scene, 64).agrees(Share.of(result.settled))
    assert float(np.quantile(result.settling_time, 0.9)) < 8.0


@pytest.mark.parametrize("name", [PAPER, SIX, CALIBRATED])
def test_a_nominal_run_is_that_of_an_own_plant(name: str) -> None:
    """Amplitudes with an exact sensor: three cycles within what 12 % of the tube's loss allow."""
    exact = {"sensor.amplitude_noise": "0 um", "sensor.phase_noise": "0 deg"}
    scene = bundled(name, exact)
    (traced,) = balancer_of(scene).run({}, AS_GIVEN, trace=True).traced
    theirs = [sample.measurement.amplitude for sample in cast("Any", traced.run).samples[:4]]
    machine = drawn(scene, number=-1, seed=0, phase=scene.rotor.initial_phase)
    mine = run(machine, settings_of(scene), noise_seed=0).trace[:4, 1]
    moved = scene.rotor.initial_amplitude - mine
    assert np.abs(theirs - mine)[1:] == pytest.approx(0.0, abs=0.06 * float(moved[1]))


@pytest.mark.parametrize(
    ("pressure", "verdict"),
    [
        ("0.56 MPa", MET),
        pytest.param("0.42 MPa", MISSED, marks=pytest.mark.heavy),
        pytest.param("0.70 MPa", MISSED, marks=pytest.mark.heavy),
    ],
)
def test_the_seed_moves_no_verdict(pressure: str, verdict: str) -> None:
    for seed in (0, 1, 2):
        scene = bundled(PAPER, {"gas.pressure": pressure, "run.seed": seed})
        assert judged_all(balancer_of(scene), [OFFSET])[0].verdict == verdict


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("pressure", "verdict"), [("0.56 MPa", MET), ("0.42 MPa", MISSED), ("0.70 MPa", MISSED)]
)
def test_twice_the_draws_move_no_verdict(pressure: str, verdict: str) -> None:
    balancer = balancer_of(bundled(PAPER, {"gas.pressure": pressure}))
    (decided,) = judged_all(balancer, [OFFSET])
    draws = decided.outcomes.settled.size
    (twice,) = judged_all(balancer, [OFFSET], first=2 * draws, most=2 * draws)
    assert decided.verdict == twice.verdict == verdict


@pytest.mark.parametrize(
    ("name", "lowest", "highest"),
    [
        (CALIBRATED, 0.0, math.inf),
        pytest.param(SIX, 0.0, math.inf, marks=pytest.mark.heavy),
        pytest.param(PAPER, 0.52e6, 0.60e6, marks=pytest.mark.heavy),
    ],
)
def test_recommended_settings_hold_in_the_own_plant(name: str, lowest: float, highest: float) -> None:
    """Both plants meet the fraction asked for, and settle from every direction as the scene says."""
    # The own plant has this kind alone; a scene that gives it keeps it.
    scene = bundled(name, {"controller.kind": "target_vector"})
    best = tuned(balancer_of(scene)).recommended
    assert best.verdict == MET
    scene = with_values_at(scene, best.settings)
    assert scene.controller.kind == "target_vector"
    assert lowest <= scene.gas.pressure <= highest
    settings = settings_of(scene, offset=scene.controller.offsets(scene.disc.chambers)[0])
    assert Share.of(np.isfinite(settling_times(scene, settings, numbers=256, seed=SEED))).low >= ASKED
    for degrees in range(0, 360, 30):
        phase = math.radians(degrees)
        turned = with_tables(scene, rotor={"initial_phase": phase})
        assert balancer_of(turned).run_all([{}], AS_GIVEN)[0].settled.all(), degrees
        machine = drawn(scene, number=-1, seed=0, phase=phase)
        assert math.isfinite(run(machine, settings, noise_seed=degrees).settling_time), degrees
