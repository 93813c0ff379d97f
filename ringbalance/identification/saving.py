"""Fitted scene as a file: the scene with measured values in place of assumed ones.

It has every fitted value: parameters, held inputs as pulled by the data, and corrections of the models of the
tube; and, in [fitted], the joint uncertainty of all of these.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import combinations
from pathlib import Path, PurePath
from typing import Any, Final

import numpy as np

from ringbalance.identification.fitting import FitResult, FittedParameter
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.parameters import START, inputs_of, path_of
from ringbalance.results.rows import text_of
from ringbalance.scene.changes import document_of, file_text
from ringbalance.scene.describe import usual_unit
from ringbalance.scene.errors import MODEL_ERRORS, MODEL_KINDS
from ringbalance.scene.faults import SceneError
from ringbalance.scene.fitted import ERROR_NAME, MODEL, NO_UNIT
from ringbalance.scene.keys.schema import ORIGIN
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.origins import MeasuredFile, MeasuredFinding, Origin
from ringbalance.scene.platform.files import write_whole
from ringbalance.scene.uncertain import NORMAL_95, SHAPE
from ringbalance.scene.units import DIMENSIONS, format_quantity, unit_factor, unit_of

_DIGITS: Final = 9
_PARTS: Final = ("even", "odd")
_ENTRY: Final = re.compile(r"(\w+)\.(\w+)(?:\[(\d)\])?")
_LIST_ENTRIES: Final = 2
"""Number of entries of a list, one for each mass."""
_RISE_DIGITS: Final = 4
_TOGETHER: Final = 0.5
"""Correlation beyond which two errors are reported as correlated."""
_FINDING_CHARACTERS: Final = 200
_ANY_SIGN: Final = ("lag_angle", "phase")
"""Keys whose uncertainty may be larger than the value."""
_KEPT: Final = "the uncertainty stays as it was, because it applies to both masses: {} was fitted alone"
_CUT: Final = "the interval of {} is wider than its value, which a scene cannot state: it is cut to the value"


def save_result(
    path: Path,
    *,
    scene: AnyScene,
    result: FitResult,
    data: Sequence[Observations],
    said: str = "",
) -> Path:
    """Write the scene of a fit, see `_fitted_scene`: keys are kept, comments are not.

    Args: `scene`: before the fit. `said`: verdict on the fit.
    Raises: SceneError: the fitted values make no scene. OSError: the file cannot be written.
    """
    files = [
        MeasuredFile(file=PurePath(each.file).name, kind=each.kind, rows=len(each), sha256=each.sha256)
        for each in data
    ]
    texts = [("residuals", said)] if said else []
    texts += [("value", f"{each.name}: {doubt}") for each in result.parameters for doubt in each.doubts]
    texts += [("value", each.text) for each in result.pulled]
    for product in result.combinations:
        words = text_of("product_identified", product=product.text, uncertainty=product.relative_uncertainty)
        texts.append(("combination", words))
    for (i, first), (j, second) in combinations(enumerate(result.parameters), 2):
        value = float(result.correlations[i, j])
        if abs(value) > _TOGETHER:
            words = text_of("errors_correlated", first=first.name, second=second.name, correlation=value)
            texts.append(("correlation", words))
    findings = [
        MeasuredFinding(
            about=about,
            text=text if len(text) <= _FINDING_CHARACTERS else f"{text[: _FINDING_CHARACTERS - 4]} ...",
        )
        for about, text in texts
    ]
    fitted = [each for each in result.parameters if each.name not in START]
    saved = _fitted_scene(scene, fitted=fitted, files=files, findings=findings, result=result)
    return write_whole(path, file_text(saved, to=path.parent, all_keys=True))


def kept_start(scene: AnyScene, data: Sequence[Observations]) -> Iterator[str]:
    """Yield a sentence for each file of trial weights that has runs without one.

    What these show is that day's vibration, so that it does not replace `rotor.initial_vibration`.
    """
    for each in data:
        if each.kind not in ("trial_weight", "trial_amplitude"):
            continue
        rotor, bare = liquid_ring_scene(scene).rotor, each.where(each.columns["unbalance"] == 0)
        if not len(bare):
            continue
        measured = format_quantity(float(np.mean(bare.columns["amplitude"])), "length", "um", digits=3)
        if "phase" in bare.columns:
            measured = _vector_text(complex(np.mean(bare.vectors())))
        stated = _vector_text(cmath.rect(rotor.initial_amplitude, rotor.initial_phase))
        yield text_of("start_kept", file=PurePath(each.file).name, measured=measured, stated=stated)


def _vector_text(vibration: complex) -> str:
    """Text of a vibration, m zero to peak: "6 um at 40 deg"."""
    phase = cmath.phase(vibration) % (2 * math.pi)
    size = format_quantity(abs(vibration), "length", "um", digits=3)
    return f"{size} at {format_quantity(phase, 'angle', 'deg', digits=3)}"


def _fitted_scene(
    scene: AnyScene,
    *,
    fitted: Sequence[FittedParameter],
    files: Sequence[MeasuredFile],
    findings: Sequence[MeasuredFinding] = (),
    result: FitResult | None = None,
) -> AnyScene:
    """Scene with fitted values, their uncertainties and origins, checked like a file.

    Held inputs remain as stated if their fitted values contradict each other, such as a wall inside the port:
    those that the error names, else those of the disc, else all.
    Args: `result`: fit with the joint distribution, and with the values of held inputs in its scene.
    Raises: SceneError: the fitted values make no scene, such as a crest outside the port. ValueError: a path
        that no scene file has.
    """
    held = [] if result is None else [name for name in result.held if name not in MODEL_ERRORS]
    pulled = {name: path_of(name).split(".")[-1].split("[")[0] for name in held}
    while True:
        changes = _FileChanges(scene)
        if result is not None and result.joint.names:
            _put_joint(changes, result, pulled)
        keyed = [(changes.scene_key(each.path), each) for each in fitted]
        for scene_key, each in keyed:
            changes.put(scene_key, each.value, origin=each.origin)
        cut = tuple(_put_widths(changes, keyed))
        changes.values["measured.files"] = [asdict(each) for each in files]
        changes.values["measured.quantities"] = [scene_key.record(each) for scene_key, each in keyed]
        changes.values["measured.findings"] = [asdict(each) for each in (*findings, *cut)]
        try:
            return scene.with_values(changes.whole())
        except SceneError as error:
            keys = set(pulled.values())
            suspects = ({fault.key for fault in error.faults}, set(SHAPE), keys)
            suspected = next((each & keys for each in suspects if each & keys), None)
            if suspected is None:
                raise
            pulled = {name: key for name, key in pulled.items() if key not in suspected}


@dataclass(frozen=True, kw_only=True)
class _SceneKey:
    """Key of a value in a scene file, with its unit there."""

    table: str
    key: str
    entry: int | None
    """Index in a list; None for a single value."""
    width: str
    """Path of the uncertainty of the value."""
    dimension: str | None
    unit: str
    """Unit in the file; empty for a number without unit."""

    @property
    def path(self) -> str:
        """Path of the value, or of the list."""
        return f"{self.table}.{self.key}"

    def written(self, value: float) -> str | float:
        """Value, SI, as written in the file."""
        return self.number(value) if self.dimension is None else f"{self.number(value)!r} {self.unit}"

    def number(self, value: float) -> float:
        """Number of a value, SI, in the file's unit."""
        if self.dimension is None:
            return _rounded(value)
        return float(format_quantity(value, self.dimension, self.unit, digits=_DIGITS).split(" ")[0])

    def record(self, fitted: FittedParameter) -> dict[str, Any]:
        """Make an entry of [measured]; ends that the interval does not have are left out."""
        low, high = fitted.before_interval or (None, None)
        numbers = {
            "before": fitted.before,
            "before_low": low,
            "before_high": high,
            "value": fitted.value,
            "low": fitted.interval[0],
            "high": fitted.interval[1],
        }
        return {
            "quantity": fitted.path,
            "unit": self.unit or NO_UNIT,
            **{name: self.number(number) for name, number in numbers.items() if number is not None},
            "verdict": str(fitted.verdict),
            "profile": [self.number(value) for value, _ in fitted.curve],
            "rise": [float(f"{rise:.{_RISE_DIGITS}g}") for _, rise in fitted.curve],
        }

    def difference(self, value: float) -> float:
        """Number of a difference of two values, SI, in the file's unit."""
        return _rounded(value / (unit_factor(self.unit) if self.unit else 1.0))


@dataclass
class _FileChanges:
    """Changes of a scene file by a fit: values by path, and their origins."""

    scene: AnyScene
    values: dict[str, Any] = field(default_factory=dict)
    origins: dict[str, dict[str, Origin]] = field(default_factory=dict)

    def before(self, path: str) -> Any:
        """Value of the file at a path; None if absent."""
        value: Any = document_of(self.scene)
        for step in path.split("."):
            value = value.get(step) if isinstance(value, Mapping) else None
        return value

    def scene_key(self, path: str) -> _SceneKey:
        """Key of a path such as "tube.bore" or "masses.friction_arm[0]".

        Raises: ValueError: a scene file has no such value.
        """
        schema = scene_kind(self.scene.balancer).schema
        match = _ENTRY.fullmatch(path)
        if match is None or match[1] not in schema.tables or match[2] not in schema.tables[match[1]].keys:
            raise ValueError(f"a scene file has no value {path!r}")
        table, key, entry = match.groups()
        dimension = schema.key_at((table, key)).takes.dimension
        by_table = table in schema.tables["uncertainty"].keys
        before, unit = self.before(f"{table}.{key}"), ""
        if dimension is not None:
            # The unit in the file, else the usual unit of the quantity.
            first = before[0] if isinstance(before, list) and before else before
            stated = unit_of(first) if isinstance(first, str) else ""
            unit = stated or usual_unit(path) or DIMENSIONS[dimension].si_unit
        return _SceneKey(
            table=table,
            key=key,
            entry=None if entry is None else int(entry),
            width=f"uncertainty.{table}.{key}" if by_table else f"uncertainty.{key}",
            dimension=dimension,
            unit=unit,
        )

    def put(self, scene_key: _SceneKey, value: float, *, origin: Origin) -> None:
        """Set a value, SI, with its origin."""
        written: Any = scene_key.written(value)
        if scene_key.entry is not None:
            zeros = [scene_key.written(0.0)] * _LIST_ENTRIES
            both = list(self.values.get(scene_key.path) or self.before(scene_key.path) or zeros)
            both[scene_key.entry] = written
            written = both
        self.values[scene_key.path] = written
        self.origins.setdefault(scene_key.table, {})[scene_key.key] = origin

    def whole(self) -> dict[str, Any]:
        """Values by path, followed by origins."""
        origins = {
            f"{table}.{ORIGIN}": {**(self.before(f"{table}.{ORIGIN}") or {}), **keys}
            for table, keys in self.origins.items()
        }
        return {**self.values, **origins}


def _put_joint(changes: _FileChanges, result: FitResult, pulled: Collection[str]) -> None:
    """Write values of held inputs, corrections of models and the joint distribution.

    Every error of k has both its parts; a part without effect on the data keeps its uncertainty and is
    independent.
    Args: `pulled`: held inputs whose values are written.
    """
    names, size, scene, values = result.joint.names, result.joint.deviations, result.scene, changes.values
    indices = [i for i, name in enumerate(names) if name not in START]
    causes = {match[1] for name in names if (match := ERROR_NAME.fullmatch(name)) and match[2]}
    pairs = [f"{MODEL}{cause}, {part}" for cause in MODEL_KINDS if cause in causes for part in _PARTS]
    lacking = [name for name in pairs if name not in names]
    deviations = {names[i]: float(size[i]) for i in indices} | dict.fromkeys(lacking, 1.0)
    correlations = np.eye(len(deviations))
    correlation = result.joint.covariance[np.ix_(indices, indices)] / np.outer(size[indices], size[indices])
    correlations[: len(indices), : len(indices)] = np.clip((correlation + correlation.T) / 2, -1.0, 1.0)
    np.fill_diagonal(correlations, 1.0)
    quantities, inputs = [], inputs_of(scene).inputs
    for (name, sd), row in zip(deviations.items(), correlations.tolist(), strict=True):
        path, unit, deviation = name, "", _rounded(sd)
        if name not in MODEL_ERRORS:
            path, scene_key = path_of(name), changes.scene_key(path_of(name))
            unit, deviation = scene_key.unit, scene_key.difference(sd)
            if name in pulled:
                # The uncertainty of the value alone, without correlations.
                value, width, before = inputs[name].value, NORMAL_95 * sd, changes.before(scene_key.path)
                single = scene_key.entry is None or not isinstance(before, list)
                if (before if single else before[scene_key.entry]) != scene_key.written(value):
                    changes.put(scene_key, value, origin="inferred")
                if scene_key.entry is None:
                    values[scene_key.width] = scene_key.written(min(width, abs(value)) if value else width)
        quantities.append(
            {
                "quantity": path,
                "unit": unit or NO_UNIT,
                "standard_deviation": deviation,
                "correlations": [round(each, _DIGITS) for each in row],
            }
        )
    if any(name in MODEL_ERRORS for name in deviations):
        sums: dict[str, dict[str, Any]] = {}
        for error in liquid_ring_scene(scene).tube.model_errors:
            parts = sums.setdefault(error.cause, {"cause": error.cause, "even": 0.0, "odd": 0.0})
            parts |= {"even": parts["even"] + error.even, "odd": parts["odd"] + error.odd}
        if sums:
            rounded = [each | {part: _rounded(each[part]) for part in _PARTS} for each in sums.values()]
            values["tube.model_errors"] = rounded
            changes.origins.setdefault("tube", {})["model_errors"] = "inferred"
    if "pressure" in deviations and ("pressure" in pulled or "pressure" not in result.held):
        scene_key = changes.scene_key("gas.gauge_correction")
        values[scene_key.path] = scene_key.written(liquid_ring_scene(scene).gas.gauge_correction)
    values["fitted.quantities"] = quantities


def _put_widths(
    changes: _FileChanges, keyed: Iterable[tuple[_SceneKey, FittedParameter]]
) -> Iterator[MeasuredFinding]:
    """Write the uncertainties; entries of a list share the largest. Yields: Findings on uncertainties that a
    scene cannot state."""
    by_path: dict[str, list[tuple[_SceneKey, FittedParameter]]] = {}
    for scene_key, parameter in keyed:
        by_path.setdefault(scene_key.path, []).append((scene_key, parameter))
    for group in by_path.values():
        scene_key, each = group[0][0], [parameter for _, parameter in group]
        width = max((w for parameter in each if (w := parameter.half_width) is not None), default=None)
        if width is None:
            continue
        if (
            scene_key.entry is not None
            and len(each) < _LIST_ENTRIES
            and changes.before(scene_key.width) is not None
        ):
            # The uncertainty applies to both entries, of which only one was fitted.
            yield MeasuredFinding(about="uncertainty", text=_KEPT.format(each[0].path))
            continue
        largest = min(abs(parameter.value) for parameter in each)
        cut = width > largest and scene_key.key not in _ANY_SIGN
        changes.values[scene_key.width] = scene_key.written(largest if cut else width)
        if cut:
            yield MeasuredFinding(about="uncertainty", text=_CUT.format(each[0].path))


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
