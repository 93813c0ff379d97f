"""Write the example files of measurements in scenes/measurements/: a documented truth, noise, fixed seeds.

python tools/example_measurements.py            prints the files
python tools/example_measurements.py --write    writes them
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.identification.data.kinds import KINDS
from ringbalance.identification.data.observations import Observations
from ringbalance.identification.predict.device import models_of
from ringbalance.identification.predict.kinds import PREDICTED
from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene, write_whole
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.describe import in_usual_unit, usual_name, usual_unit
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES, with_value
from ringbalance.scene.units import format_quantity

FOLDER: Final = Path(__file__).resolve().parents[1] / "scenes" / "measurements"
TRUTH: Final = {
    "lambda_factor": 0.97,
    "bore": 1.46e-3,
    "extra_loss": 1.5,
    "influence_coefficient": 0.0112,
    "lag_angle": math.radians(19),
    "density": 998.2,
}
"""SI; everything else is the scene's value."""
_SCENE: Final = "liquid_ring_paper"
_VIBRATION_NOISE: Final = 0.02e-6
"""Standard deviation of each component, m."""
_RELATIVE_NOISE: Final = {"transfer": 0.01, "flow": 0.01, "pressure": 0.005}
_DIGITS: Final = {"um": 3, "deg": 2}


def truth() -> Scene:
    """The disc that the examples were measured on."""
    scene = liquid_ring_scene(load_scene(bundled_scene(_SCENE)))
    for name, value in TRUTH.items():
        scene = with_value(scene=scene, quantity=name, value=value)
    return scene


def example(kind: str) -> str:
    """Text of one example."""
    plan, stated = _PLANS[kind]()
    seed = 1000 + sorted(_PLANS).index(kind)
    return _text(kind, _measured(kind, plan, np.random.default_rng(seed)), stated)


def _observations(kind: str, columns: Mapping[str, npt.ArrayLike], chamber: Sequence[str]) -> Observations:
    rows = np.size(next(iter(columns.values())))
    return Observations(
        kind=kind,
        file=kind,
        lines=np.arange(1, rows + 1),
        series=np.array(["day 1"] * rows),
        chamber=np.array(chamber or [""] * rows),
        columns={name: np.asarray(values, dtype=np.float64) for name, values in columns.items()},
        uncertainty={},
    )


def _measured(kind: str, plan: Observations, random: np.random.Generator) -> Observations:
    """The plan with what the truth predicts, and noise."""
    scene = truth()
    found = PREDICTED[kind].predict(scene, plan, models_of(scene))
    columns = dict(plan.columns)
    if kind in _RELATIVE_NOISE:
        noise = _RELATIVE_NOISE[kind] * random.standard_normal(len(plan))
        columns[PREDICTED[kind].column(plan)] = found * (1 + noise)
    else:
        start = scene.rotor.initial_amplitude * np.exp(1j * scene.rotor.initial_phase)
        change = found[: len(plan)] + 1j * found[len(plan) :]
        columns |= _vibrations(kind, start, change, random)
    return _observations(kind, columns, plan.chamber.tolist())


def _vibrations(
    kind: str, start: complex, change: ComplexArray, random: np.random.Generator
) -> dict[str, FloatArray]:
    """Readings; that after an injection is that before the next one."""
    if kind == "trial_weight":
        return _polar("", _read(start + change, random))
    readings = _read(start + np.concatenate([[0], np.cumsum(change)]), random)
    return _polar("_before", readings[:-1]) | _polar("_after", readings[1:])


def _read(vibration: ComplexArray, random: np.random.Generator) -> ComplexArray:
    noise = random.standard_normal((2, vibration.size)) * _VIBRATION_NOISE
    return np.asarray(vibration + noise[0] + 1j * noise[1])


def _polar(when: str, vibration: ComplexArray) -> dict[str, FloatArray]:
    return {f"amplitude{when}": np.abs(vibration), f"phase{when}": np.angle(vibration)}


def _trial_weight() -> tuple[Observations, str]:
    weights = [0, 200, 200, 200, 400, 400, 0]
    angles = [0, 0, 120, 240, 0, 180, 0]
    columns = {"unbalance": 1e-6 * np.array(weights), "angle": np.radians(angles)}
    return _observations("trial_weight", columns, []), '{ amplitude = "0.04 um" }'


def _injection() -> tuple[Observations, str]:
    times = 1e-3 * np.array([60, 80, 120, 200, 300, 450])
    columns = {"gas_time": np.tile(times, 4), "pressure": np.repeat([0.65e6, 0.7e6, 0.75e6, 0.8e6], 6)}
    return _observations("injection", columns, [*("ABCD" * 3), *("CDAB" * 3)]), ""


def _transfer() -> tuple[Observations, str]:
    columns = {
        "fill_ratio": [0.25] * 6 + [0.35] * 3,
        "pressure": [0.7e6] * 3 + [0.8e6] * 6,
        "gas_time": [0.2, 0.4, 0.8] * 3,
        "mass": [1.0] * 9,
    }
    return _observations("transfer", columns, []), "0.02"


def _flow() -> tuple[Observations, str]:
    columns = {"pressure_difference": [1e3, 2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5, 3e5, 5e5, 7e5]}
    return _observations("flow", columns, []), "0.02"


def _pressure() -> tuple[Observations, str]:
    columns = {"radius": [44.5e-3] * 5, "fill_ratio": [0.1, 0.2, 0.3, 0.4, 0.5]}
    return _observations("pressure", columns, []), ""


_PLANS: Final[Mapping[str, Callable[[], tuple[Observations, str]]]] = {
    "trial_weight": _trial_weight,
    "injection": _injection,
    "transfer": _transfer,
    "flow": _flow,
    "pressure": _pressure,
}
EXAMPLES: Final = tuple(_PLANS)


def _text(kind: str, measured: Observations, stated: str) -> str:
    declared = [column for column in KINDS[kind].columns if column.name in measured.columns]
    heads = [
        *(["chamber"] if KINDS[kind].has_chamber else []),
        *(column.head for column in declared),
        "series",
    ]
    lines = [
        f'# kind = "{kind}"  # {KINDS[kind].title}',
        '# source = "made up by tools/example_measurements.py, not measured"',
        f'# conditions = "{_SCENE} with {_told()}"',
        *(['# amplitude = "zero_to_peak"'] if KINDS[kind].has_amplitudes else []),
        *([f"# uncertainty = {stated}  # expanded (95 %)"] if stated else []),
        ",".join(heads),
    ]
    for row in range(len(measured)):
        letters = [str(measured.chamber[row])] if KINDS[kind].has_chamber else []
        values = [(column, float(measured.columns[column.name][row])) for column in declared]
        cells = [_cell(value, column.dimension, column.unit) for column, value in values]
        lines.append(",".join([*letters, *cells, str(measured.series[row])]))
    return "\n".join(lines) + "\n"


def _cell(value: float, dimension: str | None, unit: str) -> str:
    if dimension is None:
        return f"{value:.4g}"
    number = float(format_quantity(value, dimension, unit, digits=12).split(" ")[0])
    return f"{number:.{_DIGITS[unit]}f}" if unit in _DIGITS else f"{number:.4g}"


def _told() -> str:
    """The truth in words."""
    paths = [f"{UNCERTAIN_QUANTITIES[name]}.{name}" for name in TRUTH]
    return ", ".join(
        f"{usual_name(path)} {in_usual_unit(path, value):.4g} {usual_unit(path)}".rstrip()
        for path, value in zip(paths, TRUTH.values(), strict=True)
    )


if __name__ == "__main__":
    for name in EXAMPLES:
        if "--write" in sys.argv:
            write_whole(FOLDER / f"{name}.csv", example(name))
        else:
            print(example(name))
