"""A fitted scene as a file: the scene with what was measured in the place of what was supposed.

It holds every value as fitted: parameters, the held inputs where the data pull them, and what corrects the
models of the tube; and, in [fitted], how uncertain all of these are together.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from itertools import combinations
from pathlib import Path, PurePath
from typing import Any, Final

from ringbalance.identification.identifiability import Combination
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.parameters import START
from ringbalance.identification.result import FitResult, FittedParameter
from ringbalance.identification.saved_joint import JointEntry, Place, joint_entries, place_of, put_joint
from ringbalance.scene.faults import SceneError
from ringbalance.scene.keys.schema import ORIGIN
from ringbalance.scene.loader import scene_from
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.origins import MeasuredFile, MeasuredFinding
from ringbalance.scene.platform.files import write_whole
from ringbalance.scene.toml import toml_bytes
from ringbalance.scene.uncertain import SHAPE

_RISE_DIGITS: Final = 4
_NO_UNIT: Final = "1"
_TOGETHER: Final = 0.5
"""Correlation from which two errors are said to go together."""
_LONGEST: Final = 200
"""Characters of a finding, as of any text of a scene file."""
_ANY_SIGN: Final = ("lag_angle", "phase")
"""Keys whose uncertainty may be larger than the value."""
_ENTRIES: Final = 2
"""Of a list, one for each mass."""
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
        *(MeasuredFinding(about="value", text=_short(each)) for each in result.pulled),
        *(MeasuredFinding(about="combination", text=_combination(each)) for each in result.combinations),
        *(MeasuredFinding(about="correlation", text=each) for each in _correlations(result)),
    ]
    fitted = [each for each in result.parameters if each.name not in START]
    together = joint_entries(result)
    return _save_fitted(
        path, text=text, fitted=fitted, files=files, findings=findings, joint=together, scene=result.scene
    )


def _found_from(text: str, *, folder: Path, to: Path) -> str:
    """A scene whose mesh, if it names one, is found from another folder."""
    document = tomllib.loads(text)
    mesh = document.get("disc", {}).get("mesh")
    if mesh is None or folder.resolve() == to.resolve():
        return text
    document["disc"]["mesh"] = Path(os.path.relpath(folder / mesh, to)).as_posix()
    return toml_bytes(document).decode()


def _combination(found: Combination) -> str:
    return f"the data identify {found.text} within {100 * found.relative_uncertainty:.2g} %"


def _correlations(result: FitResult) -> Iterator[str]:
    names = [each.name for each in result.parameters]
    for i, j in combinations(range(len(names)), 2):
        value = float(result.correlations[i, j])
        if abs(value) > _TOGETHER:
            yield f"the errors of {names[i]} and {names[j]} go together (correlation {value:.2f})"


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
    joint: Sequence[JointEntry] = (),
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
    joint: Sequence[JointEntry] = (),
    pulled: Sequence[JointEntry] = (),
    scene: AnyScene | None = None,
) -> bytes:
    """The bytes of that scene, not yet tried. Args: `pulled`: those of `joint` whose values are written."""
    document: dict[str, Any] = tomllib.loads(text)
    put_joint(document, joint, pulled, scene)
    placed = [(place_of(each.path, document), each) for each in fitted]
    for place, each in placed:
        _put_value(document, place, each)
    cut = tuple(_put_widths(document, placed))
    document["measured"] = {
        "files": [asdict(each) for each in files],
        "quantities": [_record(place, each) for place, each in placed],
        "findings": [asdict(each) for each in (*findings, *cut)],
    }
    return toml_bytes(document)


def _put_value(document: dict[str, Any], place: Place, fitted: FittedParameter) -> None:
    place.put(document, fitted.value)
    document[place.table].setdefault(ORIGIN, {})[place.key] = fitted.origin


def _put_widths(
    document: dict[str, Any], placed: Iterable[tuple[Place, FittedParameter]]
) -> Iterator[MeasuredFinding]:
    """Write the uncertainties; entries of a list share the largest. Yields: What a scene cannot state."""
    by_key: dict[tuple[str, str], list[tuple[Place, FittedParameter]]] = {}
    for place, one in placed:
        by_key.setdefault((place.table, place.key), []).append((place, one))
    for group in by_key.values():
        place, each = group[0][0], [one for _, one in group]
        width = max((w for one in each if (w := one.half_width) is not None), default=None)
        if width is None:
            continue
        largest = min(abs(one.value) for one in each)
        cut = width > largest and place.key not in _ANY_SIGN
        inside = document.setdefault("uncertainty", {})
        inside = inside.setdefault(place.table, {}) if place.by_table else inside
        if place.entry is not None and len(each) < _ENTRIES and place.key in inside:
            # The uncertainty stands for both entries, and nothing was learnt of the other one.
            yield MeasuredFinding(about="uncertainty", text=_KEPT.format(each[0].path))
            continue
        inside[place.key] = place.written(largest if cut else width)
        if cut:
            yield MeasuredFinding(about="uncertainty", text=_CUT.format(each[0].path))


def _record(place: Place, fitted: FittedParameter) -> dict[str, Any]:
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
        "unit": place.unit or _NO_UNIT,
        **{name: place.number(number) for name, number in numbers.items() if number is not None},
        "verdict": str(fitted.verdict),
        "profile": [place.number(value) for value, _ in fitted.curve],
        "rise": [float(f"{rise:.{_RISE_DIGITS}g}") for _, rise in fitted.curve],
    }
