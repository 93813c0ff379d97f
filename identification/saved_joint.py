"""What was fitted together, as a scene file has it: pulled values, corrections of models, and [fitted]."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ringbalance.identification.balancers import value_of
from ringbalance.identification.parameters import START
from ringbalance.identification.result import FitResult, path_of
from ringbalance.scene.describe import usual_unit
from ringbalance.scene.fitted import ERROR_NAME, MODEL, NO_UNIT, ModelError
from ringbalance.scene.keys.fields import Reader
from ringbalance.scene.keys.schema import ORIGIN
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene
from ringbalance.scene.registry import balancers
from ringbalance.scene.uncertain import NORMAL_95
from ringbalance.scene.units import DIMENSIONS, format_quantity, unit_factor, unit_of

_DIGITS: Final = 9
_PARTS: Final = ("even", "odd")
_ENTRY: Final = re.compile(r"(\w+)\.(\w+)(?:\[(\d)\])?")
_ENTRIES: Final = 2
"""Of a list, one for each mass."""


@dataclass(frozen=True, kw_only=True)
class Place:
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


def place_of(path: str, document: Mapping[str, Any]) -> Place:
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
    return Place(
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
class JointEntry:
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


def joint_entries(result: FitResult) -> list[JointEntry]:
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
        JointEntry(
            name=name,
            held=name in result.held or name in lacking,
            standard_deviation=sd,
            correlations=tuple(round(float(r), _DIGITS) for r in row),
        )
        for (name, sd), row in zip(everything, whole, strict=True)
    ]


def put_joint(
    document: dict[str, Any],
    joint: Sequence[JointEntry],
    pulled: Sequence[JointEntry],
    scene: AnyScene | None,
) -> None:
    """Write values of held inputs, corrections and the joint distribution into a scene's document.

    Args: `pulled`: those whose values are written. `scene`: that has them.
    """
    if scene is None or not joint:
        return
    values = [(place_of(each.path, document), each) for each in pulled if each.held and not each.is_model]
    for place, each in values:
        _put_value(document, place, value_of(scene, each.name))
        _put_width(document, place, each.standard_deviation, value_of(scene, each.name))
    if any(each.is_model for each in joint):
        _put_errors(document, liquid_ring_scene(scene))
    if any(each.name == "pressure" for each in (*pulled, *joint) if each in pulled or not each.held):
        correction = liquid_ring_scene(scene).gas.gauge_correction
        place_of("gas.gauge_correction", document).put(document, correction)
    document["fitted"] = {"quantities": list(_quantities(document, joint))}


def _put_value(document: dict[str, Any], place: Place, value: float) -> None:
    """Write a value that a fit has moved; where it stays as it is, nothing changes."""
    if place.put(document, value):
        document[place.table].setdefault(ORIGIN, {})[place.key] = "inferred"


def _put_width(document: dict[str, Any], place: Place, size: float, value: float) -> None:
    """State the uncertainty that is left, for whoever looks at one quantity."""
    inside = document.setdefault("uncertainty", {})
    inside = inside.setdefault(place.table, {}) if place.by_table else inside
    if place.entry is None:
        inside[place.key] = place.written(min(NORMAL_95 * size, abs(value)) if value else NORMAL_95 * size)


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


def _quantities(document: dict[str, Any], joint: Sequence[JointEntry]) -> Iterator[dict[str, Any]]:
    for each in joint:
        place = None if each.is_model else place_of(each.path, document)
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
