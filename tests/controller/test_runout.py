"""Runout of the sensor: the loop balances the reading, and the rotor keeps the runout."""

from __future__ import annotations

import cmath
import math
from itertools import permutations
from typing import Any, Final, cast

import numpy as np
import pytest
from own_draws import drawn
from own_plant import Run, Share, run, settings_of

import ringbalance
from ringbalance.controller import compare as compare_module
from ringbalance.controller.balancer import Draws, balancer_of
from ringbalance.controller.compare import compare
from ringbalance.controller.document import simulation_history
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.rotor import joined_rotor, rotors_of
from ringbalance.export import disc
from ringbalance.export.blocks import disc_block
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.pieces.point import BLOCK
from ringbalance.results.requirements import MET, MISSED
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from scenes import bundled, with_tables

ASKED: Final = 0.9
SEED: Final = 29
LIMIT: Final = 0.05e-6
OFFSET_S: Final = 2.3e-3
TUNED: Final = {
    "gas.pressure": "0.526 MPa",
    "controller.proportional": "0.0808 s/um",
    "controller.integral_time": "5 s",
    "controller.gas_time_offset": "2.3 ms",
}
"""Settings under which nearly all devices of the paper's disc settle."""
PHASE = "sensor.runout_phase"


def with_runout(amplitude: str, phase: str | None = None, **values: object) -> Scene:
    runout = {"amplitude": amplitude} | ({} if phase is None else {"phase": phase})
    scene = bundled("liquid_ring_paper", {**TUNED, "sensor.runout": runout})
    result: Scene = scene.with_values({key.replace("__", "."): value for key, value in values.items()})
    return result


def own_runs(scene: Scene, amplitude: float, count: int) -> list[Run]:
    settings = settings_of(scene, offset=OFFSET_S)
    turns = np.random.default_rng(SEED).uniform(0.0, 2 * math.pi, count)
    return [
        run(
            drawn(scene, number=i, seed=SEED),
            settings,
            noise_seed=SEED + i,
            runout=cmath.rect(amplitude, turn),
        )
        for i, turn in enumerate(turns.tolist())
    ]


# Nine in ten of the readings settle, as without runout.  A rotor keeps the runout to within the limit of the
# reading; medians of the small one agree within a fifth of the limit, their scatter over 48 devices.
@pytest.mark.parametrize(("text", "amplitude"), [("1 um", 1e-6), ("0.02 um", 0.02e-6)])
def test_readings_settle_and_rotors_keep_the_runout(text: str, amplitude: float) -> None:
    scene = with_runout(text)
    outcomes = balancer_of(scene).run_all([{}], Draws.first(64))[0]
    mine = own_runs(scene, amplitude, 48)
    theirs = Share.of(outcomes.settled)
    own = Share.of(np.isfinite([each.settling_time for each in mine]))
    assert theirs.agrees(own)
    assert min(theirs.value, own.value) >= ASKED
    rotors = [
        outcomes.final_amplitude[outcomes.settled],
        np.array([each.residual for each in mine if math.isfinite(each.settling_time)]),
    ]
    for residuals in rotors:
        assert np.all(np.abs(residuals - amplitude) <= 1.2 * LIMIT)
        assert (
            np.mean(residuals <= LIMIT) == 0.0 if amplitude > 2 * LIMIT else np.mean(residuals <= LIMIT) > 0.9
        )
    assert abs(np.median(rotors[0]) - np.median(rotors[1])) <= 0.2 * LIMIT


def test_the_rotor_is_the_reading_without_the_runout() -> None:
    """The loop sees the sum alone: the run is that of a rotor which starts with the sum."""
    runout, scene = cmath.rect(1e-6, math.radians(70)), with_runout("1 um", "70 deg")
    result = ringbalance.simulate(scene)
    first = scene.rotor.initial_vibration + runout
    exact = {"amplitude": f"{abs(first)!r} m", "phase": f"{math.degrees(cmath.phase(first))!r} deg"}
    summed = ringbalance.simulate(
        scene.with_values({"sensor.runout": None, "rotor.initial_vibration": exact})
    )
    assert result.settling_time == summed.settling_time
    assert result.reading == pytest.approx(summed.amplitude, abs=1e-12)
    for run_, expected in ((result, result.reading), (summed, summed.reading)):
        vector = run_.amplitude * np.exp(1j * run_.phase) + run_.scene.sensor.runout
        assert np.abs(vector) == pytest.approx(expected, rel=1e-12)
    rotor = result.amplitude * np.exp(1j * result.phase)
    assert rotor + runout == pytest.approx(summed.amplitude * np.exp(1j * summed.phase), abs=1e-17)
    assert abs(result.amplitude[-1] - 1e-6) <= LIMIT
    codes = [each.code for each in result.findings]
    assert "runout" in codes
    assert "runout_phase_open" not in codes
    (traced,) = balancer_of(scene).run({}, Draws.first(1), trace=True).traced
    assert traced.final_amplitude == pytest.approx(
        balancer_of(scene).run({}, Draws.first(1)).final_amplitude[0], abs=0.1 * LIMIT
    )


def test_a_run_shows_reading_and_rotor() -> None:
    result = ringbalance.simulate(with_runout("1 um", requirement__residual="0.05 um"))
    codes = [each.code for each in result.findings]
    assert codes[0] == "settled"
    assert {"runout", "runout_phase_open", "rotor_above_requirement"} <= set(codes)
    document, history = result.to_dict(), simulation_history(result)
    assert document["reading_amplitude_m"] == history["reading_amplitude_m"] == result.reading.tolist()
    values = {each["key"]: each["value"] for each in (*document["quantities"], *document["conventions"])}
    assert values["final_reading"] <= LIMIT < values["final_amplitude"]
    influence = result.scene.rotor.influence_coefficient
    assert values["residual_unbalance"] == pytest.approx(values["final_amplitude"] / influence)


def test_a_scene_without_runout_answers_as_before() -> None:
    """Draws are by name: a drawn phase moves neither another input nor the noise."""
    scene = bundled("liquid_ring_paper", TUNED)
    plain = balancer_of(scene).run_all([{}], Draws.first(4))[0]
    least = balancer_of(with_tables(scene, sensor={"runout_amplitude": 1e-18})).run_all([{}], Draws.first(4))[
        0
    ]
    assert set(least.inputs) - set(plain.inputs) == {PHASE}
    for name, places in plain.inputs.items():
        assert np.array_equal(places, least.inputs[name]), name
    assert least.settling_time == pytest.approx(plain.settling_time, rel=1e-9)
    result = ringbalance.simulate(scene)
    assert np.array_equal(result.reading, result.amplitude)
    assert "reading_amplitude_m" not in result.to_dict()
    assert "reading_amplitude_m" not in simulation_history(result)


@pytest.mark.parametrize(
    ("stated", "verdict"),
    [({}, MET), ({"requirement__residual": "0.05 um"}, MISSED), ({"requirement__residual": "1.5 um"}, MET)],
)
def test_the_rotor_is_judged_where_something_is_required_of_it(stated: dict[str, Any], verdict: str) -> None:
    """A limit of the controller is one of the reading."""
    balancer = balancer_of(with_runout("1 um", **stated))
    (result,) = judged_all(balancer, [{}], most=64)
    assert result.verdict == verdict
    demands = {each.code: each for each in (*result.demands, *result.reported)}
    fraction = result.fraction_of(demands["rotor_amplitude"]).value
    assert fraction == (1.0 if stated.get("requirement__residual") == "1.5 um" else 0.0)
    assert result.fraction_of(result.demands[0]).value > ASKED
    assert bool(result.reported) == (not stated)


def test_the_phase_is_drawn_where_it_is_not_stated() -> None:
    names = []
    for scene in (with_runout("1 um"), with_runout("1 um", "0 deg")):
        balancer = balancer_of(scene)
        names.append({each["name"] for each in balancer.information(scene).document["drawn"]})
        phases = balancer.run_all([{}], Draws.first(64))[0].inputs.get(PHASE)
        assert (phases is None) == (PHASE not in names[-1])
        if phases is not None:
            assert abs(np.mean(np.exp(2j * math.pi * phases))) < 0.05
    assert names[0] - names[1] == {PHASE}


def test_an_exported_disc_has_the_reading() -> None:
    scene, runout = with_runout("1 um", "30 deg"), cmath.rect(1e-6, math.radians(30))
    law = cast("Any", calibrate(scene).flow_law)
    block, bare = disc_block(scene, law), disc_block(scene.with_values({"sensor.runout": None}), law)
    start = int(block.constants[BLOCK]) + disc.START_X
    read, own = (complex(*each.constants[start : start + 2]) for each in (block, bare))
    assert read - own == pytest.approx(runout, abs=1e-18)
    assert [*block.constants[:start], *block.constants[start + 2 :]] == [
        *bare.constants[:start],
        *bare.constants[start + 2 :],
    ]
    assert "runout" in block.facts
    assert "runout" not in bare.facts


@pytest.mark.parametrize(
    ("name", "runout", "text"),
    [
        ("liquid_ring_paper", {"amplitude": "-1 um"}, "runout.amplitude = .* must be above 0"),
        ("liquid_ring_paper", {"amplitude": "1 kg"}, "a unit of mass, not of length"),
        ("liquid_ring_paper", {"phase": "3 deg"}, "runout.amplitude is missing"),
        ("liquid_ring_paper", "1 um", "it is not a table; allowed: a table with amplitude, phase"),
        ("driven_masses_small", {"amplitude": "1 um"}, "a scene of the balancer liquid_ring has it"),
    ],
)
def test_a_broken_runout_is_one_error(name: str, runout: object, text: str) -> None:
    scene = ringbalance.load_scene(ringbalance.bundled_scene(name))
    with pytest.raises(SceneError, match=text) as error:
        scene.with_values({"sensor.runout": runout})
    assert len(error.value.faults) == 1


@pytest.mark.parametrize("required", [False, True])
def test_a_comparison_has_one_runout_for_both(required: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """With 1 um all readings settle and no rotor comes below 0.05 um; that of one scene holds for both, with
    the same phase of a numbered device.  A residual that one scene requires is one of the rotor."""
    monkeypatch.setattr(compare_module, "searched", lambda *_, **__: {})
    stated = {"requirement__residual": "0.05 um"} if required else {}
    scenes = with_runout("1 um", **stated), bundled("liquid_ring_paper", TUNED)
    balancers = [balancer_of(scene.with_values({"run.time_limit": "15 s"})) for scene in scenes]
    result, reverse = compare(*balancers, most=8), compare(*balancers[::-1], most=8)
    values = {each.key: each.value for each in result.rows().quantities}
    assert values["runout"] == 1e-6
    assert [values[f"{i}.fraction_settled"] for i in (1, 2)] == [1.0, 1.0]
    assert [values[f"{i}.fraction_rotor"] for i in (1, 2)] == [0.0, 0.0]
    assert [side.fraction.count for side in result.sides] == ([0, 0] if required else [8, 8])
    assert [side.fraction for side in reverse.sides] == [side.fraction for side in result.sides]
    (finding,) = [each for each in result.rows().findings if each.code == "compared_runout"]
    assert ("rotor" in finding.text) == required
    for side in result.sides:
        assert np.all(np.abs(side.outcomes.final_amplitude - 1e-6) <= 1.2 * LIMIT)
    rotors = rotors_of(
        joined_rotor(*(each.rotor() for each in balancers)), *(each.rotor for each in balancers)
    )
    phases = [
        cast(Any, each.on_rotor(rotors(3), rotors)).drawn_runs.device(3).scene.sensor.runout_phase
        for each in balancers
    ]
    assert phases[0] == phases[1] != 0.0


def test_the_larger_runout_is_that_of_both() -> None:
    rotors = [
        balancer_of(with_runout(*each)).rotor() for each in (("1 um", "70 deg"), ("2 um",), ("2 um", "9 deg"))
    ]
    for first, second in permutations(rotors, 2):
        runout = joined_rotor(first, second).runout
        assert runout is not None
        assert runout.amplitude == 2e-6
        assert (runout.phase is None) == (rotors[1] in (first, second))


def test_eccentric_masses_take_no_runout() -> None:
    masses = balancer_of(ringbalance.load_scene(ringbalance.bundled_scene("driven_masses_small")))
    with pytest.raises(SceneError, match="has runout, which runs of eccentric masses do not model"):
        masses.on_rotor(balancer_of(with_runout("1 um")).rotor())
