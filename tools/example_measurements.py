"""Example files of measurements in scenes/measurements/: simulated with documented true values, noise and
fixed seeds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.eccentric_mass.scene_records import eccentric_scene
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.parameters import inputs_of
from ringbalance.identification.reading import KINDS
from ringbalance.scene import AnyScene, bundled_scene, load_scene
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.describe import in_usual_unit, usual_name, usual_unit
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import with_values_at
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES, with_value
from ringbalance.scene.units import format_quantity

FOLDER: Final = Path(__file__).resolve().parents[1] / "scenes" / "measurements"
TRUTH: Final[Mapping[str, Mapping[str, float]]] = {
    "liquid_ring": {
        "lambda_factor": 0.97,
        "bore": 1.46e-3,
        "extra_loss": 1.5,
        "influence_coefficient": 0.0112,
        "lag_angle": math.radians(19),
        "density": 998.2,
    },
    "eccentric_mass": {
        "rotor.stiffness": 1012.0,
        "rotor.damping": 11.5,
        "imbalance.mass": 0.1805,
        "imbalance.phase": 0.77,
        "masses.friction_arm[0]": 0.012,
        "motor.torque_constant": 0.0097,
    },
}
"""True values by balancer and path, SI; all others are those of the scene."""
SCENES: Final = {"liquid_ring": "liquid_ring_paper", "eccentric_mass": "eccentric_mass_paper"}
_VIBRATION_NOISE: Final = {"liquid_ring": 0.02e-6, "eccentric_mass": 20e-6}
"""Standard deviation of each component of the vibration by balancer, m."""
_ANGLE_NOISE: Final = math.radians(0.1)
"""Standard deviation of the angle of a mass, rad."""
_RELATIVE_NOISE: Final = {"transfer": 0.01, "flow": 0.01, "pressure": 0.005}
RPM: Final = math.pi / 30
_DIGITS: Final = {"um": 3, "deg": 2}


def truth(kind: str) -> AnyScene:
    """Scene with the true values for an example of a kind."""
    balancer = KINDS[kind].balancer
    scene = load_scene(bundled_scene(SCENES[balancer]))
    for name, value in TRUTH[balancer].items():
        if isinstance(scene, Scene):
            scene = with_value(scene=scene, quantity=name, value=value)
        else:
            scene = with_values_at(eccentric_scene(scene), {name: value})
    return scene


def example(kind: str) -> str:
    """Text of one example."""
    plan, stated = _PLANS[kind]()
    # One seed in twenty gives noise with a pattern that the tests of a fit reject; none of these does.
    seed = 1000 + list(_PLANS).index(kind)
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
    """The plan with predictions for the true values, plus noise."""
    scene = truth(kind)
    exact = KINDS[kind].predict(scene, plan, inputs_of(scene).models)
    columns = dict(plan.columns)
    if kind == "trial_amplitude":
        size = _VIBRATION_NOISE["liquid_ring"]
        columns["amplitude"] = np.abs(exact + size * random.standard_normal(len(plan)))
    elif KINDS[kind].has_amplitudes:
        columns |= _vibrations(kind, exact[: len(plan)] + 1j * exact[len(plan) :], scene, random)
    else:
        noise = _RELATIVE_NOISE[kind] * exact if kind in _RELATIVE_NOISE else _ANGLE_NOISE
        columns[KINDS[kind].noisy_column(plan)] = exact + noise * random.standard_normal(len(plan))
    return _observations(kind, columns, plan.chamber.tolist())


def _vibrations(
    kind: str, predicted: ComplexArray, scene: AnyScene, random: np.random.Generator
) -> dict[str, FloatArray]:
    """Vibration readings; the one after an injection is also the one before the next."""
    noise = _VIBRATION_NOISE[scene.balancer]
    if not isinstance(scene, Scene):
        return _polar("", _read(predicted, noise, random))
    start = scene.rotor.initial_amplitude * np.exp(1j * scene.rotor.initial_phase)
    if kind == "trial_weight":
        return _polar("", _read(start + predicted, noise, random))
    readings = _read(start + np.concatenate([[0], np.cumsum(predicted)]), noise, random)
    return _polar("_before", readings[:-1]) | _polar("_after", readings[1:])


def _read(vibration: ComplexArray, size: float, random: np.random.Generator) -> ComplexArray:
    noise = random.standard_normal((2, vibration.size)) * size
    return np.asarray(vibration + noise[0] + 1j * noise[1])


def _polar(when: str, vibration: ComplexArray) -> dict[str, FloatArray]:
    return {f"amplitude{when}": np.abs(vibration), f"phase{when}": np.angle(vibration)}


def _trial_weight() -> tuple[Observations, str]:
    weights = [0, 200, 200, 200, 400, 400, 0]
    angles = [0, 0, 120, 240, 0, 180, 0]
    columns = {"unbalance": 1e-6 * np.array(weights), "angle": np.radians(angles)}
    return _observations("trial_weight", columns, []), '{ amplitude = "0.04 um" }'


def _trial_amplitude() -> tuple[Observations, str]:
    weights, angles = [0, 200, 200, 200, 400, 400, 400, 0], [0, 0, 120, 240, 0, 120, 240, 0]
    columns = {"unbalance": 1e-6 * np.array(weights), "angle": np.radians(angles)}
    return _observations("trial_amplitude", columns, []), '{ amplitude = "0.04 um" }'


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


def _run_up() -> tuple[Observations, str]:
    return _observations("run_up", {"speed": RPM * np.arange(80, 240, 10)}, []), ""


def _positioning() -> tuple[Observations, str]:
    times, voltages = np.tile([0.1, 0.2, 0.4, 0.6, 0.8, 1.0], 3), np.repeat([6.0, 9.0, 12.0], 6)
    columns = {"time": times, "voltage": voltages, "speed": np.full(18, 100 * RPM)}
    return _observations("positioning", columns, []), ""


_PLANS: Final[Mapping[str, Callable[[], tuple[Observations, str]]]] = {
    "trial_weight": _trial_weight,
    "injection": _injection,
    "transfer": _transfer,
    "flow": _flow,
    "pressure": _pressure,
    "run_up": _run_up,
    "positioning": _positioning,
    "trial_amplitude": _trial_amplitude,
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
        f'# conditions = "{SCENES[KINDS[kind].balancer]} with {_told(KINDS[kind].balancer)}"',
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


def _told(balancer: str) -> str:
    """True values as text."""
    paths = {name: f"{UNCERTAIN_QUANTITIES.get(name, '')}.{name}".lstrip(".") for name in TRUTH[balancer]}
    return ", ".join(
        f"{usual_name(path)} {in_usual_unit(path, TRUTH[balancer][name]):.4g} {usual_unit(path)}".rstrip()
        for name, path in paths.items()
    )


def files(words: Sequence[str]) -> Iterator[tuple[Path, bytes]]:
    """The files of all kinds, or of those named."""
    for name in words or EXAMPLES:
        yield FOLDER / f"{name}.csv", example(name).encode()
