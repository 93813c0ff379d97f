"""Draw test rigs from the priors of bundled scenes, let them measure, fit the measurements, count coverage.

python tests/helpers/synthetic_rigs.py 1000 [first]  rigs `first` (0) to `first` + 999: coverage of parameters
python tests/helpers/synthetic_rigs.py speed         processor time of some 200 measurements, five parameters
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.rotor import chamber_letters
from ringbalance.identification.device import Models
from ringbalance.identification.fitting import FitResult, fit
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.reading import KINDS
from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.errors import MODEL_ERRORS
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from ringbalance.scene.uncertain import NORMAL_95, half_widths, moved, nominal_value, with_model_errors
from scenes import with_tables

SCENES: Final = ("liquid_ring_paper", "six_chamber", "perfluorinated_oil")
FITTED: Final = ("influence_coefficient", "lag_angle", "bore", "lambda_factor")
THREE_KINDS: Final = (
    ("trial_weight", "transfer", "injection"),
    ("trial_weight", "flow", "injection"),
    ("flow", "transfer", "injection"),
)
READINGS: Final = ("amplitude_before", "phase_before", "amplitude_after", "phase_after")
_DRAWN: Final = (-2.5, 2.5)
"""Standard deviations of an error of a model: beyond, a head may fall with the velocity somewhere."""
_LAMBDA_WIDTH: Final = 0.05
"""Expanded uncertainty (95 %) of the factor on lambda."""
_VIBRATION_NOISE: Final = (1e-8, 6e-8)
"""Range of the standard deviation of each component, m."""
_RELATIVE_NOISE: Final = (0.005, 0.03)


@dataclass(frozen=True, kw_only=True)
class Rig:
    """A scene as its designer has it, the device that was built, and what was measured on it."""

    scene: Scene
    truth: Scene
    data: tuple[Observations, ...]

    def true(self, name: str) -> float:
        """Value of a parameter that the device has, SI."""
        value = nominal_value(scene=self.truth, quantity=name)
        assert value is not None
        return value


def rig(number: int) -> Rig:
    """One rig; all draws follow from its number."""
    random = np.random.default_rng([17, number])
    scene = _scene(SCENES[number % len(SCENES)], random)
    truth, models = _drawn(scene, random), Models.of(scene)
    kinds = THREE_KINDS[number // len(SCENES) % len(THREE_KINDS)]
    return Rig(
        scene=scene,
        truth=truth,
        data=tuple(measured(kind, truth, models, random) for kind in kinds),
    )


def _scene(name: str, random: np.random.Generator) -> Scene:
    scene = liquid_ring_scene(load_scene(bundled_scene(name)))
    factor = InputUncertainty(quantity="lambda_factor", half_width=_LAMBDA_WIDTH, relative=False)
    return with_tables(
        scene,
        disc={"lambda_factor": 1.0},
        gas={"pressure": scene.gas.pressure * random.uniform(1.0, 1.4)},
        uncertainty=(*scene.uncertainty, factor),
    )


def _drawn(scene: Scene, random: np.random.Generator) -> Scene:
    """The device: every uncertain input and error of its models, drawn from normal distributions."""
    truth = scene
    for name, width in half_widths(scene).items():
        truth = moved(truth, {name: width / NORMAL_95 * random.standard_normal()})
    for name in MODEL_ERRORS:
        truth = with_model_errors(truth, {name: float(np.clip(random.standard_normal(), *_DRAWN))})
    return truth


def measured(
    kind: str, truth: Scene, models: Models, random: np.random.Generator, *, times: int = 1
) -> Observations:
    """What a rig measures of one kind, in six to eight rows or that many times more."""
    chambers, columns = _plan(kind, truth, random, times)
    plan = observations(kind, columns, chambers)
    found = KINDS[kind].predict(truth, plan, models)
    if kind in ("transfer", "flow"):
        sd = random.uniform(*_RELATIVE_NOISE) * np.sqrt(np.mean(found**2))
        name = KINDS[kind].noisy_column(plan)
        return observations(kind, columns | {name: found + sd * random.standard_normal(found.size)}, chambers)
    change = found[: len(plan)] + 1j * found[len(plan) :]
    return observations(kind, columns | _readings(kind, truth, change, random), chambers)


def _readings(
    kind: str, truth: Scene, change: ComplexArray, random: np.random.Generator
) -> dict[str, FloatArray]:
    """Vibrations as they are read; that after an injection is that before the next one."""
    start = truth.rotor.initial_amplitude * np.exp(1j * truth.rotor.initial_phase)
    steps = change if kind == "trial_weight" else np.concatenate([[0], np.cumsum(change)])
    noise = random.uniform(*_VIBRATION_NOISE) * random.standard_normal((2, steps.size))
    seen = start + steps + noise[0] + 1j * noise[1]
    sides = {"": seen} if kind == "trial_weight" else {"_before": seen[:-1], "_after": seen[1:]}
    return {
        f"{name}{side}": values
        for side, vibration in sides.items()
        for name, values in (("amplitude", np.abs(vibration)), ("phase", np.angle(vibration)))
    }


def _plan(
    kind: str, truth: Scene, random: np.random.Generator, times: int
) -> tuple[list[str], dict[str, npt.ArrayLike]]:
    """Chambers, and columns that the test engineer chooses."""
    pressure, total, rows = truth.gas.pressure, 2 * truth.disc.initial_fill, 8 * times
    if kind == "trial_weight":
        weights = 1e-4 * np.tile([0.0, 1, 1, 1, 2, 2], times)
        return [], {"unbalance": weights, "angle": random.uniform(0, 2 * np.pi, weights.size)}
    if kind == "flow":
        return [], {"pressure_difference": np.geomspace(2e4, 5e5, rows)}
    if kind == "transfer":
        return [], {
            "fill_ratio": random.uniform(0.4, 0.8, rows) * total,
            "pressure": pressure * random.uniform(1.0, 1.3, rows),
            "gas_time": random.uniform(0.1, 0.5, rows),
            "mass": np.ones(rows),
        }
    half, letters = truth.disc.chambers // 2, chamber_letters(truth.disc.chambers)
    chambers = [letters[i % half + half * (i // half % 2)] for i in range(4 * half * times)]
    count = len(chambers)
    return chambers, {
        "gas_time": random.uniform(0.05, 0.4, count),
        "pressure": pressure * random.uniform(1.0, 1.2, count),
        **{name: np.zeros(count) for name in READINGS},
    }


def observations(
    kind: str,
    columns: Mapping[str, npt.ArrayLike],
    chambers: Sequence[str] = (),
    widths: Mapping[str, FloatArray] = MappingProxyType({}),
) -> Observations:
    """Rows of one series. Args: `widths`: stated uncertainties, 95 %, by column."""
    rows = int(np.size(next(iter(columns.values()))))
    full = {name: np.broadcast_to(np.asarray(v, dtype=np.float64), (rows,)) for name, v in columns.items()}
    if kind == "trial_weight":
        full = {"amplitude": np.zeros(rows), "phase": np.zeros(rows)} | full
    if kind == "flow":
        full = {"flow_rate": np.ones(rows)} | full
    return Observations(
        kind=kind,
        file=f"{kind}.csv",
        sha256="0" * 64,
        lines=np.arange(2, rows + 2),
        series=np.array(["one"] * rows),
        chamber=np.array(list(chambers) or [""] * rows),
        columns=full,
        uncertainty=widths,
    )


def fitted(made: Rig) -> FitResult:
    """Parameters of `FITTED` that the rig's data inform."""
    kinds = {each.kind for each in made.data}
    lacking = {"influence_coefficient", "lag_angle"} if "trial_weight" not in kinds else set()
    return fit(made.scene, data=made.data, parameters=[n for n in FITTED if n not in lacking])


def covered(made: Rig) -> dict[str, bool]:
    """Whether the interval of each fitted parameter holds the truth."""
    return {p.name: p.interval[0] <= made.true(p.name) <= p.interval[1] for p in fitted(made).parameters}


def counted(numbers: Sequence[int]) -> tuple[Counter[str], Counter[str]]:
    """Intervals that hold the truth, and all of them, by parameter."""
    held, all_of_them = Counter[str](), Counter[str]()
    for number in numbers:
        for name, holds in covered(rig(number)).items():
            held[name] += holds
            all_of_them[name] += 1
    return held, all_of_them


def timed() -> str:
    """Processor time of a fit of four kinds of data, on an idle machine below 5 s."""
    scene = liquid_ring_scene(load_scene(bundled_scene(SCENES[0])))
    random, models = np.random.default_rng(0), Models.of(scene)
    kinds = ("trial_weight", "flow", "transfer", "injection")
    data = [measured(kind, scene, models, random, times=7) for kind in kinds]
    names = [*FITTED, "extra_loss"]
    # The first fit loads compiled code.
    fit(scene, data=data[:1])
    fit(scene, data=data[3:], parameters=["bore"])
    before = time.process_time()
    work = fit(scene, data=data, parameters=names).evaluations
    spent = time.process_time() - before
    rows = sum(len(each) for each in data)
    return f"{rows} measurements, {len(names)} parameters: {work} predictions in {spent:.2f} s"


if __name__ == "__main__" and sys.argv[1:] == ["speed"]:
    print(timed())
elif __name__ == "__main__":
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    hits, trials = counted(range(first, first + int(sys.argv[1])))
    for parameter, total in trials.items():
        print(f"{parameter}: {hits[parameter]} of {total}, {hits[parameter] / total:.1%}")
    print(f"all: {hits.total()} of {trials.total()}, {hits.total() / trials.total():.2%}")
