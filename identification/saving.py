"""A fitted scene as a file: the scene with what was measured in the place of what was supposed.

It holds every value as fitted: parameters, the held inputs where the data pull them, and what corrects the
models of the tube; and, in [fitted], how uncertain all of these are together.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path, PurePath
from typing import Any, Final

import numpy as np

from ringbalance.identification.fitting import FitResult, FittedParameter
from ringbalance.identification.identifiability import Combination
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.parameters import START, inputs_of, path_of
from ringbalance.results.rows import text_of
from ringbalance.scene.describe import usual_unit
from ringbalance.scene.faults import SceneError
from ringbalance.scene.fitted import ERROR_NAME, MODEL, NO_UNIT, ModelError
from ringbalance.scene.keys.fields import Reader
from ringbalance.scene.keys.schema import ORIGIN
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.loader import scene_from
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.origins import MeasuredFile, MeasuredFinding
from ringbalance.scene.platform.files import write_whole
from ringbalance.scene.registry import balancers
from ringbalance.scene.toml import toml_bytes
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
    text: str,
    result: FitResult,
    data: Sequence[Observations],
    folder: Path,
    said: Sequence[str] = (),
) -> Path:
    """Write the scene that a fit found, see `_save_fitted`.

    Args: `folder`: of the scene file that was fitted. `said`: what the criticism of the fit says.
    """
    text = _found_from(text, folder=folder, to=path.parent)
    files = [
        MeasuredFile(file=PurePath(each.file).name, kind=each.kind, rows=len(each), sha256=each.sha256)
        for each in data
    ]
    findings = [
        *(MeasuredFinding(about="residuals", text=_short(each)) for each in said),
        *(
            MeasuredFinding(about="value", text=_short(f"{each.name}: {doubt}"))
            for each in result.parameters
            for doubt in each.doubts
        ),
        *(MeasuredFinding(about="value", text=_short(each.text)) for each in result.pulled),
        *(MeasuredFinding(about="combination", text=_combination(each)) for each in result.combinations),
        *(MeasuredFinding(about="correlation", text=each) for each in _correlations(result)),
    ]
    fitted = [each for each in result.parameters if each.name not in START]
    together = _joint_entries(result)
    return _save_fitted(
        path, text=text, fitted=fitted, files=files, findings=findings, joint=together, scene=result.scene
    )


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Where a value stands in a scene file, and how it is written there."""

    table: str
    key: str
    entry: int | None
    """Of a list; None for a single value."""
    by_table: bool
    """Whether [uncertainty] has a table for each table."""
    dimension: str | None
    unit: str
    """Empty for a number without unit."""

    def written(self, value: float) -> str | float:
        """A value as it stands in the file."""
        number = self.number(value)
        return number if self.dimension is None else f"{number!r} {self.unit}"

    def number(self, value: float) -> float:
        """A value, SI, in the unit."""
        if self.dimension is None:
            return float(f"{value:.{_DIGITS}g}")
        return float(format_quantity(value, self.dimension, self.unit, digits=_DIGITS).split(" ")[0])

    def difference(self, value: float) -> float:
        """A difference of two values, SI, in the unit."""
        return float(f"{value / (unit_factor(self.unit) if self.unit else 1.0):.{_DIGITS}g}")

    def put(self, document: dict[str, Any], value: float) -> bool:
        """Write a value, SI; whether that changes the document."""
        content, written = document.setdefault(self.table, {}), self.written(value)
        before = content.get(self.key)
        if self.entry is None:
            content[self.key] = written
        else:
            both = list(before or [self.written(0.0)] * _ENTRIES)
            both[self.entry] = written
            content[self.key] = both
        return bool(content[self.key] != before)

    def uncertainties(self, document: dict[str, Any]) -> dict[str, Any]:
        """Where the document states its uncertainty."""
        stated: dict[str, Any] = document.setdefault("uncertainty", {})
        return stated.setdefault(self.table, {}) if self.by_table else stated


def _place_of(path: str, document: Mapping[str, Any]) -> _Place:
    """The place of a path such as "tube.bore" or "masses.friction_arm[0]".

    Raises: ValueError: a scene file has no such value.
    """
    schema = scene_kind(document.get("balancer", balancers()[0])).schema
    match = _ENTRY.fullmatch(path)
    if match is None or match[1] not in schema.tables or match[2] not in schema.tables[match[1]].keys:
        raise ValueError(f"a scene file has no value {path!r}")
    table, key, entry = match.groups()
    takes = schema.key_at((table, key)).takes
    dimension = takes.dimension if isinstance(takes, Reader) else None
    here = document.get(table, {}).get(key)
    return _Place(
        table=table,
        key=key,
        entry=None if entry is None else int(entry),
        by_table=table in schema.tables["uncertainty"].keys,
        dimension=dimension,
        unit=_unit(here, path, dimension),
    )


def _unit(here: object, path: str, dimension: str | None) -> str:
    """The unit that the file has there, else the one in which such a value is described, else the SI unit."""
    if dimension is None:
        return ""
    one = here[0] if isinstance(here, list) and here else here
    return (
        (unit_of(one) if isinstance(one, str) else "")
        or usual_unit(path)
        or next(iter(DIMENSIONS[dimension].units))
    )


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
    document: dict[str, Any],
    joint: Sequence[_JointEntry],
    pulled: Sequence[_JointEntry],
    scene: AnyScene | None,
) -> None:
    """Write values of held inputs, corrections and the joint distribution into a scene's document.

    Args: `pulled`: those whose values are written. `scene`: that has them.
    """
    if scene is None or not joint:
        return
    values = [(_place_of(each.path, document), each) for each in pulled if each.held and not each.is_model]
    known = inputs_of(scene).inputs
    for place, each in values:
        _put_value(document, place, known[each.name].value)
        _put_width(document, place, each.standard_deviation, known[each.name].value)
    if any(each.is_model for each in joint):
        _put_errors(document, liquid_ring_scene(scene))
    if any(each.name == "pressure" for each in (*pulled, *joint) if each in pulled or not each.held):
        correction = liquid_ring_scene(scene).gas.gauge_correction
        _place_of("gas.gauge_correction", document).put(document, correction)
    document["fitted"] = {"quantities": list(_quantities(document, joint))}


def _put_value(document: dict[str, Any], place: _Place, value: float) -> None:
    """Write a value that a fit has moved; where it stays as it is, nothing changes."""
    if place.put(document, value):
        document[place.table].setdefault(ORIGIN, {})[place.key] = "inferred"


def _put_width(document: dict[str, Any], place: _Place, size: float, value: float) -> None:
    """State the uncertainty that is left, for whoever looks at one quantity."""
    if place.entry is None:
        place.uncertainties(document)[place.key] = place.written(
            min(NORMAL_95 * size, abs(value)) if value else NORMAL_95 * size
        )


def _put_errors(document: dict[str, Any], scene: Scene) -> None:
    """Corrections of models, one entry a cause."""
    causes = dict.fromkeys(each.cause for each in scene.tube.model_errors)
    sums = [
        ModelError(
            cause=cause,
            even=sum(each.even for each in scene.tube.model_errors if each.cause == cause),
            odd=sum(each.odd for each in scene.tube.model_errors if each.cause == cause),
        )
        for cause in causes
    ]
    if sums:
        document["tube"]["model_errors"] = [
            {"cause": each.cause, "even": _rounded(each.even), "odd": _rounded(each.odd)} for each in sums
        ]
        document["tube"].setdefault(ORIGIN, {})["model_errors"] = "inferred"


def _quantities(document: dict[str, Any], joint: Sequence[_JointEntry]) -> Iterator[dict[str, Any]]:
    for each in joint:
        place = None if each.is_model else _place_of(each.path, document)
        yield {
            "quantity": each.path,
            "unit": NO_UNIT if place is None or not place.unit else place.unit,
            "standard_deviation": _rounded(each.standard_deviation)
            if place is None
            else place.difference(each.standard_deviation),
            "correlations": list(each.correlations),
        }


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def _found_from(text: str, *, folder: Path, to: Path) -> str:
    """A scene whose mesh, if it names one, is found from another folder."""
    document = tomllib.loads(text)
    mesh = document.get("disc", {}).get("mesh")
    if mesh is None or folder.resolve() == to.resolve():
        return text
    document["disc"]["mesh"] = Path(os.path.relpath(folder / mesh, to)).as_posix()
    return toml_bytes(document).decode()


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


def _save_fitted(
    path: Path,
    *,
    text: str,
    fitted: Sequence[FittedParameter],
    files: Sequence[MeasuredFile],
    findings: Sequence[MeasuredFinding] = (),
    joint: Sequence[_JointEntry] = (),
    scene: AnyScene | None = None,
) -> Path:
    """Write a scene with fitted values, their uncertainties and origins; whole or not at all.

    Every key of the scene stays, its comments do not.
    Held inputs stay as stated where their fitted values make no scene, such as a wall inside the port.
    Args: `text`: of the scene file that was fitted. `joint`: what was fitted together. `scene`: as fitted.
    Raises: SceneError: the fitted values make no scene, such as a crest outside the port. OSError: the file
        cannot be written.
    """
    held = list(joint)
    while True:
        content = _fitted_scene(
            text, fitted=fitted, files=files, findings=findings, joint=joint, pulled=held, scene=scene
        )
        try:
            scene_from(content=content, file=str(path))
        except SceneError as error:
            wrong = {fault.key for fault in error.faults}
            for suspected in (wrong, set(SHAPE), {each.key for each in held}):
                left = [each for each in held if each.key not in suspected]
                if len(left) < len(held):
                    held = left
                    break
            else:
                raise
        else:
            return write_whole(path, content.decode())


def _fitted_scene(
    text: str,
    *,
    fitted: Sequence[FittedParameter],
    files: Sequence[MeasuredFile],
    findings: Sequence[MeasuredFinding] = (),
    joint: Sequence[_JointEntry] = (),
    pulled: Sequence[_JointEntry] = (),
    scene: AnyScene | None = None,
) -> bytes:
    """The bytes of that scene, not yet tried. Args: `pulled`: those of `joint` whose values are written."""
    document: dict[str, Any] = tomllib.loads(text)
    _put_joint(document, joint, pulled, scene)
    placed = [(_place_of(each.path, document), each) for each in fitted]
    for place, each in placed:
        place.put(document, each.value)
        document[place.table].setdefault(ORIGIN, {})[place.key] = each.origin
    cut = tuple(_put_widths(document, placed))
    document["measured"] = {
        "files": [asdict(each) for each in files],
        "quantities": [_record(place, each) for place, each in placed],
        "findings": [asdict(each) for each in (*findings, *cut)],
    }
    return toml_bytes(document)


def _put_widths(
    document: dict[str, Any], placed: Iterable[tuple[_Place, FittedParameter]]
) -> Iterator[MeasuredFinding]:
    """Write the uncertainties; entries of a list share the largest. Yields: What a scene cannot state."""
    by_key: dict[tuple[str, str], list[tuple[_Place, FittedParameter]]] = {}
    for place, one in placed:
        by_key.setdefault((place.table, place.key), []).append((place, one))
    for group in by_key.values():
        place, each = group[0][0], [one for _, one in group]
        width = max((w for one in each if (w := one.half_width) is not None), default=None)
        if width is None:
            continue
        largest = min(abs(one.value) for one in each)
        cut = width > largest and place.key not in _ANY_SIGN
        inside = place.uncertainties(document)
        if place.entry is not None and len(each) < _ENTRIES and place.key in inside:
            # The uncertainty stands for both entries, and nothing was learnt of the other one.
            yield MeasuredFinding(about="uncertainty", text=_KEPT.format(each[0].path))
            continue
        inside[place.key] = place.written(largest if cut else width)
        if cut:
            yield MeasuredFinding(about="uncertainty", text=_CUT.format(each[0].path))


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
