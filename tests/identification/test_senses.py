"""Angles counted in each of eight senses: the reading is named, or the sense is called undecided."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from synthetic_rigs import READINGS, observations

from ringbalance.cli import main
from ringbalance.controller.rotor import chamber_letters
from ringbalance.identification.device import Models
from ringbalance.identification.fitting import problem_of
from ringbalance.identification.intervals import about_pulls
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.misreadings import Joint
from ringbalance.identification.optimisation import optimum, optimum_as_stated
from ringbalance.identification.reading import KINDS
from ringbalance.identification.reading_likelihood import ReadingComparison
from ringbalance.identification.readings import Reading, other_readings
from ringbalance.scene import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from scenes import with_tables

NOISE = 3e-8
START = 1e-5 * np.exp(1.5j)
TURNED = ("phases_turned", "weights_turned", "chambers_turned")
NO_LAG_STATED = """[disc]
outer_radius = "44.5 mm"
inner_radius = "20.5 mm"
axial_width = "62 mm"
central_angle = "90 deg"
[liquid]
name = "water"
temperature = "20 degC"
[tube]
bore = "1.5 mm"
hump_radius = "31.5 mm"
length = "120 mm"
[gas]
pressure = "0.7 MPa"
[rotor]
speed = "10000 rpm"
"""


def seen(change: np.ndarray, kind: str, random: np.random.Generator) -> dict[str, np.ndarray]:
    """Amplitudes and phases with noise; the vibration after an injection is that before the next one."""
    count = change.size // 2
    vibration = change[:count] + 1j * change[count:]
    if kind == "injection":
        vibration = np.concatenate([[0], np.cumsum(vibration)])
    noise = NOISE * random.standard_normal((2, vibration.size))
    vibration = START + vibration + noise[0] + 1j * noise[1]
    sides = (
        {"": vibration} if kind == "trial_weight" else {"_before": vibration[:-1], "_after": vibration[1:]}
    )
    return {
        f"{name}{side}": part(values)
        for side, values in sides.items()
        for name, part in (("amplitude", np.abs), ("phase", np.angle))
    }


def rig(scene: Scene, lag: float, letters: str, *, weights: Sequence[float]) -> list[Observations]:
    """Trial weights and, where chambers are driven, injections of a rotor with a lag, rad."""
    random = np.random.default_rng(7)
    truth = with_tables(scene, rotor={"lag_angle": lag})
    sizes = np.where(np.arange(len(weights)) > 0, 3e-4, 0.0)
    plans = [observations("trial_weight", {"unbalance": sizes, "angle": np.radians(weights)})]
    if letters:
        count = len(letters)
        columns = {"gas_time": np.linspace(0.1, 0.4, count), "pressure": np.full(count, scene.gas.pressure)}
        plans.append(observations("injection", columns | dict.fromkeys(READINGS, 0.0), letters))
    models = Models.of(scene)
    return [
        each.with_columns(**seen(KINDS[each.kind].predict(truth, each, models), each.kind, random))
        for each in plans
    ]


def counted(data: Observations, senses: Sequence[bool]) -> Observations:
    """Phases, weights and chambers as an instrument writes them that counts some against the rotation."""
    phases, weights, chambers = senses
    turned = {
        name: -values
        for name, values in data.columns.items()
        if (phases and name.startswith("phase")) or (weights and name == "angle")
    }
    letters = chamber_letters(4)
    driven = [letters[-letters.index(c) % 4] if chambers and c else c for c in data.chamber.tolist()]
    return replace(data.with_columns(**turned), chamber=np.array(driven))


@pytest.fixture(scope="module")
def rig_scene(paper_scene: Scene) -> Scene:
    """A disc of which the influence coefficient alone is uncertain, and no lag is stated."""
    known = InputUncertainty(quantity="influence_coefficient", half_width=0.07, relative=True)
    return with_tables(paper_scene, tube={"drag_coefficient": 3.0}, uncertainty=(known,))


def readings(scene: Scene, data: Sequence[Observations]) -> tuple[Reading, ...]:
    problem = problem_of(scene, data, ["influence_coefficient", "lag_angle"])
    nothing = np.zeros((problem.measured.size, 0))
    return other_readings(optimum(problem, nothing, loss="linear", starts=1))


def told(found: Sequence[Reading]) -> tuple[set[str], set[str]]:
    """Codes of readings that are named, and of those that are undecided."""
    return {each.code for each in found if each.named}, {each.code for each in found if each.undecided}


def code(senses: Sequence[bool]) -> str:
    return "+".join(name for name, one in zip(TURNED, senses, strict=True) if one)


WEIGHTS = (0, 0, 120, 240, 60, 180, 300)
OFTEN = {(19, "ABCDAB"), (170, "ACCAAC")}
RIGS = [
    pytest.param(
        lag, letters, WEIGHTS, marks=() if not letters or (lag, letters) in OFTEN else pytest.mark.heavy
    )
    for letters in ("", "ABCDAB", "ACCAAC")
    for lag in (19, 90, 170, 2)
]


@pytest.mark.parametrize(("lag", "letters", "weights"), RIGS)
def test_eight_senses_are_named_or_called_undecided(
    rig_scene: Scene, lag: float, letters: str, weights: Sequence[float]
) -> None:
    """The sense in which chambers are lettered shows where one off the line of A is driven, and only then."""
    made = rig(rig_scene, math.radians(lag), letters, weights=weights)
    unseen = bool(letters) and "B" not in letters
    for senses in product([False, True], [False, True], [False, True] if letters else [False]):
        named, undecided = told(readings(rig_scene, [counted(each, senses) for each in made]))
        alike = {code(senses)}
        if unseen:
            alike |= {code((*senses[:2], not senses[2]))}
        assert named == (set() if "" in alike else alike)
        assert undecided == (alike - {""} if unseen else set())


def test_senses_that_gain_about_as_much_are_told_apart_by_fits(
    rig_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Far from the scene the linear gain of the senses that mirror the right ones may be the larger."""
    made = rig(rig_scene, math.radians(40), "ABCDAB", weights=WEIGHTS)
    linear = ReadingComparison.gain

    def curved(compare: ReadingComparison, joint: Joint, chosen: Sequence[int]) -> float | None:
        gain = linear(compare, joint, chosen)
        mirror = [each.code for each in joint] == [*TURNED[:2]] and len(chosen) == 2
        return gain * 1.02 + 100 if gain is not None and mirror else gain

    monkeypatch.setattr(ReadingComparison, "gain", curved)
    turned = [counted(each, (False, False, True)) for each in made]
    assert told(readings(rig_scene, turned)) == ({TURNED[2]}, set())


@pytest.mark.parametrize("lag", [0.05, 179.95])
def test_a_lag_too_near_to_its_ends_leaves_the_sense_undecided(rig_scene: Scene, lag: float) -> None:
    """Phases and weights together change the sign of the lag alone."""
    (made,) = rig(rig_scene, math.radians(lag), "", weights=WEIGHTS)
    both = "phases_turned+weights_turned"
    assert told(readings(rig_scene, [made])) == (set(), {both})
    assert told(readings(rig_scene, [counted(made, (True, True, False))])) == (set(), {both})
    alone = {"phases_turned", "weights_turned"}
    assert told(readings(rig_scene, [counted(made, (True, False, False))])) == (alone, alone)


def test_no_sense_of_a_file_that_nothing_explains_fits_as_well(rig_scene: Scene) -> None:
    """The undecided rig of before: once the fit explains nothing of it, nothing fits as well."""
    (made,) = rig(rig_scene, 0.0009, "", weights=WEIGHTS)
    problem = problem_of(rig_scene, [made], ["influence_coefficient", "lag_angle"])
    best = optimum(problem, np.zeros((problem.measured.size, 0)), loss="linear", starts=1)
    both = {"phases_turned+weights_turned"}
    assert told(other_readings(best)) == (set(), both)
    found = other_readings(best, unexplained=[made.file])
    assert told(found) == (set(), set())
    assert not any("as well" in each.text for each in found)


def test_a_factor_that_a_fit_takes_up_is_no_part_of_the_sense(paper_scene: Scene) -> None:
    """Chambers alone turned, on a device other than stated: the wrong fit pulls the held inputs far off."""
    names = ["influence_coefficient", "lag_angle", "lambda_factor", "bore", "extra_loss"]
    made = rig(paper_scene, paper_scene.rotor.lag_angle, "ABCDAB", weights=WEIGHTS)
    problem = problem_of(paper_scene, made, names)
    truth = problem.scene_at(problem.start + np.array([0, 0.03, -0.03, -0.02, 0]))
    models, random = Models.of(truth), np.random.default_rng(7)
    data = []
    for each in made:
        change = KINDS[each.kind].predict(truth, each, models)
        columns = seen(change, each.kind, random)
        noise = {name: np.full(len(each), 2 * NOISE) for name in columns if name.startswith("amplitude")}
        right = replace(each.with_columns(**columns), uncertainty=noise)
        data.append(counted(right, (False, False, True)))
    problem = problem_of(paper_scene, data, names)
    best, held = optimum_as_stated(problem, loss="linear", starts=1)
    best = about_pulls(best, held, scene=paper_scene, loss="linear")
    assert told(other_readings(best, stated=paper_scene)) == ({"chambers_turned"}, set())


def test_doubled_amplitudes_are_named_with_the_sense(rig_scene: Scene) -> None:
    weights, injections = rig(rig_scene, math.radians(40), "ABCDAB", weights=WEIGHTS)
    halved = {n: v / 2 for n, v in injections.columns.items() if n.startswith("amplitude")}
    data = [weights, counted(injections.with_columns(**halved), (False, False, True))]
    assert told(readings(rig_scene, data)) == ({"chambers_turned+amplitudes_doubled"}, set())


def test_weights_on_one_line_do_not_tell_their_sense(rig_scene: Scene) -> None:
    (made,) = rig(rig_scene, math.radians(40), "", weights=(0, 0, 180, 0, 180))
    assert told(readings(rig_scene, [made])) == (set(), {"weights_turned"})


def test_a_stated_lag_beyond_180_degrees_is_no_sign_of_a_sense(rig_scene: Scene) -> None:
    """A sensor that stands elsewhere than the mark, say."""
    lag = math.radians(200)
    turned = with_tables(rig_scene, rotor={"lag_angle": lag})
    (made,) = rig(turned, lag, "", weights=WEIGHTS)
    assert told(readings(turned, [made])) == (set(), {"phases_turned+weights_turned"})


@pytest.mark.parametrize("stated", [True, False])
def test_all_angles_against_the_rotation_fail_a_fit(
    rig_scene: Scene, tmp_path: Path, capsys: pytest.CaptureFixture[str], stated: bool
) -> None:
    """A rotor with 19 degrees of lag, its file as instruments write it: no lag of -19 is called measured."""
    (made,) = rig(rig_scene, math.radians(19), "", weights=WEIGHTS)
    data, scene, saved = (tmp_path / name for name in ("weights.csv", "scene.toml", "saved.toml"))
    rows = zip(*(made.columns[n] for n in ("unbalance", "angle", "amplitude", "phase")), strict=True)
    data.write_text(
        '# kind = "trial_weight"\n# source = "a rig"\n# amplitude = "zero_to_peak"\n'
        + ('# uncertainty = { amplitude = "0.06 um" }\n' if stated else "")
        + "unbalance [g*mm],angle [deg],amplitude [um],phase [deg],note\n"
        + "\n".join(
            f"{1e6 * u:.6g},{math.degrees(-a):.6g},{1e6 * z:.4f},{math.degrees(-p):.3f},{i}"
            for i, (u, a, z, p) in enumerate(rows)
        )
        + "\n"
    )
    scene.write_text(NO_LAG_STATED)
    assert main(["fit", str(scene), str(data), "--json", "--save", str(saved)]) == 1
    found = json.loads(capsys.readouterr().out)
    (named,) = [each for each in found["criticism"]["readings"] if each["named"]]
    assert named["code"] == "phases_turned+weights_turned"
    lag = next(each for each in found["parameters"] if each["name"] == "lag_angle")
    assert math.degrees(lag["value"]) == pytest.approx(-19, abs=1)
    assert any("0 to 180 degrees" in each for each in lag["doubts"])
    assert load_scene(saved).origin_of("rotor.lag_angle") == "inferred"
