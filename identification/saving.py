"""A fitted scene as a file: the scene with what was measured in the place of what was supposed.

It holds every value as fitted: parameters, the held inputs where the data pull them, and what corrects the
models of the tube; and, in [fitted], how uncertain all of these are together.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import combinations
from pathlib import Path, PurePath
from typing import Any, Final

import numpy as np

from ringbalance.identification.fitting import FitResult, FittedParameter
from ringbalance.identification.identifiability import Combination
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.parameters import START, inputs_of, path_of
from ringbalance.results.rows import text_of
from ringbalance.scene.changes import document_of, file_text
from ringbalance.scene.describe import usual_unit
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
_ENTRIES: Final = 2
"""Of a list, one for each mass."""
_RISE_DIGITS: Final = 4
_TOGETHER: Final = 0.5
"""Correlation from which two errors are said to go together."""
_LONGEST: Final = 200
"""Characters of a finding, as of any text of a scene file."""
_ANY_SIGN: Final = ("lag_angle", "phase")
"""Keys whose uncertainty may be larger than the value."""
_KEPT: Final = "the uncertainty before stays, since it is that of both masses too: {} was fitted alone"
_CUT: Final = "the interval of {} is wider than its value, which a scene cannot state: it has the value"


def save_result(
    path: Path,
    *,
    scene: AnyScene,
    result: FitResult,
    data: Sequence[Observations],
    said: Sequence[str] = (),
) -> Path:
    """Write the scene that a fit found, see `_fitted_scene`: every key of the scene stays, no comment does.

    Args: `scene`: that was fitted. `said`: what the criticism of the fit says.
    Raises: SceneError: the fitted values make no scene. OSError: the file cannot be written.
    """
    files = [
        MeasuredFile(file=PurePath(each.file).name, kind=each.kind, rows=len(each), sha256=each.sha256)
        for each in data
    ]
    texts = [
        *(("residuals", each) for each in said),
        *(("value", f"{each.name}: {doubt}") for each in result.parameters for doubt in each.doubts),
        *(("value", each.text) for each in result.pulled),
        *(("combination", _combination(each)) for each in result.combinations),
        *(("correlation", each) for each in _correlations(result)),
    ]
    saved = _fitted_scene(
        scene,
        fitted=[each for each in result.parameters if each.name not in START],
        files=files,
        findings=[MeasuredFinding(about=about, text=_short(text)) for about, text in texts],
        joint=_joint_entries(result),
        found=result.scene,
    )
    return write_whole(path, file_text(saved, to=path.parent))


def _fitted_scene(
    scene: AnyScene,
    *,
    fitted: Sequence[FittedParameter],
    files: Sequence[MeasuredFile],
    findings: Sequence[MeasuredFinding] = (),
    joint: Sequence[_JointEntry] = (),
    found: AnyScene | None = None,
) -> AnyScene:
    """A scene with fitted values, their uncertainties and origins, checked as a file is.

    Held inputs stay as stated where their fitted values make no scene, such as a wall inside the port.
    Args: `joint`: what was fitted together. `found`: the scene that has the values of its held inputs.
    Raises: SceneError: the fitted values make no scene, such as a crest outside the port. ValueError: a path
        that no scene file has.
    """
    pulled = list(joint)
    while True:
        changes = _Changes(scene)
        if found is not None and joint:
            _put_joint(changes, joint, pulled, found)
        placed = [(changes.place(each.path), each) for each in fitted]
        for place, each in placed:
            changes.put(place, each.value, origin=each.origin)
        cut = tuple(_put_widths(changes, placed))
        changes.values["measured.files"] = [asdict(each) for each in files]
        changes.values["measured.quantities"] = [_record(place, each) for place, each in placed]
        changes.values["measured.findings"] = [asdict(each) for each in (*findings, *cut)]
        try:
            return scene.with_values(changes.whole())
        except SceneError as error:
            pulled = _fewer(pulled, error)


def _fewer(pulled: Sequence[_JointEntry], error: SceneError) -> list[_JointEntry]:
    """Without those that the error names, else those of the disc, else all held ones. Raises: SceneError."""
    everything = {each.key for each in pulled}
    for suspected in ({fault.key for fault in error.faults}, set(SHAPE), everything):
        if suspected & everything:
            return [each for each in pulled if each.key not in suspected]
    raise error


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Where a value stands in a scene file, and how it is written there."""

    table: str
    key: str
    entry: int | None
    """Of a list; None for a single value."""
    width: str
    """Path of its uncertainty."""
    dimension: str | None
    unit: str
    """Empty for a number without unit."""

    @property
    def path(self) -> str:
        """Of the value, or of the list."""
        return f"{self.table}.{self.key}"

    def written(self, value: float) -> str | float:
        """A value, SI, as it stands in the file."""
        number = self.number(value)
        return number if self.dimension is None else f"{number!r} {self.unit}"

    def number(self, value: float) -> float:
        """A value, SI, in the unit."""
        if self.dimension is None:
            return _rounded(value)
        return float(format_quantity(value, self.dimension, self.unit, digits=_DIGITS).split(" ")[0])

    def difference(self, value: float) -> float:
        """A difference of two values, SI, in the unit."""
        return _rounded(value / (unit_factor(self.unit) if self.unit else 1.0))


@dataclass
class _Changes:
    """Values of a scene file that a fit gives, by path, and their origins."""

    scene: AnyScene
    values: dict[str, Any] = field(default_factory=dict)
    origins: dict[str, dict[str, Origin]] = field(default_factory=dict)

    def before(self, path: str) -> Any:
        """What the file has at a path; None for nothing."""
        value: Any = document_of(self.scene)
        for step in path.split("."):
            value = value.get(step) if isinstance(value, Mapping) else None
        return value

    def place(self, path: str) -> _Place:
        """The place of a path such as "tube.bore" or "masses.friction_arm[0]".

        Raises: ValueError: a scene file has no such value.
        """
        schema = scene_kind(self.scene.balancer).schema
        match = _ENTRY.fullmatch(path)
        if match is None or match[1] not in schema.tables or match[2] not in schema.tables[match[1]].keys:
            raise ValueError(f"a scene file has no value {path!r}")
        table, key, entry = match.groups()
        dimension = schema.key_at((table, key)).takes.dimension
        by_table = table in schema.tables["uncertainty"].keys
        return _Place(
            table=table,
            key=key,
            entry=None if entry is None else int(entry),
            width=f"uncertainty.{table}.{key}" if by_table else f"uncertainty.{key}",
            dimension=dimension,
            unit=_unit(self.before(f"{table}.{key}"), path, dimension),
        )

    def put(self, place: _Place, value: float, *, origin: Origin) -> None:
        """Write a value, SI."""
        written: Any = place.written(value)
        if place.entry is not None:
            zeros = [place.written(0.0)] * _ENTRIES
            both = list(self.values.get(place.path) or self.before(place.path) or zeros)
            both[place.entry] = written
            written = both
        self.values[place.path] = written
        self.origins.setdefault(place.table, {})[place.key] = origin

    def whole(self) -> dict[str, Any]:
        """Values and, after them, origins, by path."""
        origins = {
            f"{table}.{ORIGIN}": {**(self.before(f"{table}.{ORIGIN}") or {}), **keys}
            for table, keys in self.origins.items()
        }
        return {**self.values, **origins}


def _unit(here: object, path: str, dimension: str | None) -> str:
    """The unit that the file has there, else the one in which such a value is described, else the SI unit."""
    if dimension is None:
        return ""
    one = here[0] if isinstance(here, list) and here else here
    stated = unit_of(one) if isinstance(one, str) else ""
    return stated or usual_unit(path) or DIMENSIONS[dimension].si_unit


@dataclass(frozen=True, kw_only=True)
class _JointEntry:
    """One quantity that was fitted together with others."""

    name: str
    """As the fit names it."""
    held: bool
    """Whether it was not a parameter."""
    standard_deviation: float
    """SI; of an error of a model in its stated standard deviations."""
    correlations: tuple[float, ...]
    """With all of them, in their order."""

    @property
    def is_model(self) -> bool:
        """Whether it is an error of a model and not a value."""
        return self.name.startswith(MODEL)

    @property
    def path(self) -> str:
        """As a scene file names it."""
        return self.name if self.is_model else path_of(self.name)

    @property
    def key(self) -> str:
        """In its table."""
        return self.path.split(".")[-1].split("[")[0]


def _joint_entries(result: FitResult) -> list[_JointEntry]:
    """All that was fitted together and that a scene file has; both parts of every error of k.

    A part that the data do not depend on is as uncertain as it was, and independent.
    """
    names, size = result.joint.names, result.joint.deviations
    kept = [i for i, name in enumerate(names) if name not in START]
    pairs = {
        f"{MODEL}{match[1]}, {part}": None
        for name in names
        if (match := ERROR_NAME.fullmatch(name)) and match[2]
        for part in _PARTS
    }
    lacking = [name for name in pairs if name not in names]
    whole = np.eye(len(kept) + len(lacking))
    correlations = result.joint.covariance[np.ix_(kept, kept)] / np.outer(size[kept], size[kept])
    whole[: len(kept), : len(kept)] = np.clip((correlations + correlations.T) / 2, -1.0, 1.0)
    np.fill_diagonal(whole, 1.0)
    everything = [*((names[i], float(size[i])) for i in kept), *((name, 1.0) for name in lacking)]
    return [
        _JointEntry(
            name=name,
            held=name in result.held or name in lacking,
            standard_deviation=sd,
            correlations=tuple(round(float(r), _DIGITS) for r in row),
        )
        for (name, sd), row in zip(everything, whole, strict=True)
    ]


def _put_joint(
    changes: _Changes, joint: Sequence[_JointEntry], pulled: Sequence[_JointEntry], found: AnyScene
) -> None:
    """Values of held inputs, corrections and the joint distribution.

    Args: `pulled`: those whose values are written. `found`: the scene that has them.
    """
    known = inputs_of(found).inputs
    for each in pulled:
        if each.held and not each.is_model:
            _put_held(changes, changes.place(each.path), known[each.name].value, each.standard_deviation)
    if any(each.is_model for each in joint):
        _put_errors(changes, found)
    if any(each.name == "pressure" for each in (*pulled, *(one for one in joint if not one.held))):
        place = changes.place("gas.gauge_correction")
        changes.values[place.path] = place.written(liquid_ring_scene(found).gas.gauge_correction)
    places = [None if each.is_model else changes.place(each.path) for each in joint]
    changes.values["fitted.quantities"] = [
        {
            "quantity": each.path,
            "unit": NO_UNIT if place is None or not place.unit else place.unit,
            "standard_deviation": place.difference(each.standard_deviation)
            if place is not None
            else _rounded(each.standard_deviation),
            "correlations": list(each.correlations),
        }
        for place, each in zip(places, joint, strict=True)
    ]


def _put_held(changes: _Changes, place: _Place, value: float, size: float) -> None:
    """A value that a fit has moved, and what is left of its uncertainty for whoever looks at it alone."""
    before = changes.before(place.path)
    here = before[place.entry] if place.entry is not None and isinstance(before, list) else before
    if here != place.written(value):
        changes.put(place, value, origin="inferred")
    if place.entry is None:
        width = min(NORMAL_95 * size, abs(value)) if value else NORMAL_95 * size
        changes.values[place.width] = place.written(width)


def _put_errors(changes: _Changes, found: AnyScene) -> None:
    """Corrections of models, one entry a cause."""
    errors = liquid_ring_scene(found).tube.model_errors
    sums = [
        {
            "cause": cause,
            "even": _rounded(sum(each.even for each in errors if each.cause == cause)),
            "odd": _rounded(sum(each.odd for each in errors if each.cause == cause)),
        }
        for cause in dict.fromkeys(each.cause for each in errors)
    ]
    if sums:
        changes.values["tube.model_errors"] = sums
        changes.origins.setdefault("tube", {})["model_errors"] = "inferred"


def _put_widths(
    changes: _Changes, placed: Iterable[tuple[_Place, FittedParameter]]
) -> Iterator[MeasuredFinding]:
    """Write the uncertainties; entries of a list share the largest. Yields: What a scene cannot state."""
    by_path: dict[str, list[tuple[_Place, FittedParameter]]] = {}
    for place, one in placed:
        by_path.setdefault(place.path, []).append((place, one))
    for group in by_path.values():
        place, each = group[0][0], [one for _, one in group]
        width = max((w for one in each if (w := one.half_width) is not None), default=None)
        if width is None:
            continue
        if place.entry is not None and len(each) < _ENTRIES and changes.before(place.width) is not None:
            # The uncertainty stands for both entries, and nothing was learnt of the other one.
            yield MeasuredFinding(about="uncertainty", text=_KEPT.format(each[0].path))
            continue
        largest = min(abs(one.value) for one in each)
        cut = width > largest and place.key not in _ANY_SIGN
        changes.values[place.width] = place.written(largest if cut else width)
        if cut:
            yield MeasuredFinding(about="uncertainty", text=_CUT.format(each[0].path))


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def _combination(found: Combination) -> str:
    return text_of("product_identified", product=found.text, uncertainty=found.relative_uncertainty)


def _correlations(result: FitResult) -> Iterator[str]:
    names = [each.name for each in result.parameters]
    for i, j in combinations(range(len(names)), 2):
        value = float(result.correlations[i, j])
        if abs(value) > _TOGETHER:
            yield text_of("errors_correlated", first=names[i], second=names[j], correlation=value)


def _short(text: str) -> str:
    """Text that a scene file takes."""
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4]} ..."


def _record(place: _Place, fitted: FittedParameter) -> dict[str, Any]:
    """One quantity of [measured]; ends that there are not are left out."""
    known = fitted.before_interval or (None, None)
    numbers = {
        "before": fitted.before,
        "before_low": known[0],
        "before_high": known[1],
        "value": fitted.value,
        "low": fitted.interval[0],
        "high": fitted.interval[1],
    }
    return {
        "quantity": fitted.path,
        "unit": place.unit or NO_UNIT,
        **{name: place.number(number) for name, number in numbers.items() if number is not None},
        "verdict": str(fitted.verdict),
        "profile": [place.number(value) for value, _ in fitted.curve],
        "rise": [float(f"{rise:.{_RISE_DIGITS}g}") for _, rise in fitted.curve],
    }
