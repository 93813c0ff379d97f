"""Kinds of scene file: keys, rules for values, reader and description of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.reading import SceneInput, SceneReading
from ringbalance.scene.keys.schema import Schema
from ringbalance.scene.registry import registered, unusable
from ringbalance.scene.units import format_quantity

Read = Callable[[SceneInput], tuple[SceneReading, tuple[Fault, ...]]]
"""Function that reads a document: values with derived defaults, and all errors."""


@dataclass(frozen=True, kw_only=True)
class SceneKind:
    """A kind of scene file."""

    schema: Schema
    """Keys, and the record that they are read into."""
    read: Read
    main: tuple[tuple[str, ...], ...]
    """Paths of the values that a terminal shows, line by line."""
    usual_units: Mapping[str, str] = field(default_factory=dict)
    """Displayed unit by dimension where a declaration names none; default the SI unit."""
    example: str = ""
    """Text of a scene file, for `ringbalance check-balancer`."""
    arrays: bool = False
    """True if numbers may be arrays for many designs at once, see `ringbalance.scene.designs`."""


def scene_kind(name: str) -> SceneKind:
    """The kind of scene of a registered balancer.

    Raises: KeyError: none of that name is registered. SceneError: its package cannot be used.
    """
    kind = registered("scene", name)
    if not isinstance(kind, SceneKind):
        raise unusable(name, "its scene is no ringbalance.scene.kinds.SceneKind")
    return kind


_DIMENSIONS = {"mm": "length", "um": "length", "deg": "angle", "kPa": "pressure", "s": "time", "kg": "mass"}


def written(value: float, unit: str) -> str:
    """An SI value in a unit, such as "44.5 mm"."""
    return format_quantity(value, _DIMENSIONS[unit], unit)


@dataclass(frozen=True, kw_only=True)
class Contradiction:
    """Error in a combination of values."""

    problem: str
    allowed: str


Rule = Callable[..., Contradiction | None]


@dataclass(frozen=True, kw_only=True)
class Check:
    """A rule and the values that it needs; skipped while one of them is unknown."""

    rule: Rule
    needs: tuple[str, ...]
    """Paths of the rule's arguments; the error names the first."""
    when: Callable[[SceneReading], bool]
    """Condition under which the rule applies to a scene."""
    moot: tuple[str, ...]
    """Names of earlier rules whose failure makes this one moot, so that one error does not raise others."""


def check(
    rule: Rule, *needs: str, when: Callable[[SceneReading], bool] = lambda _: True, moot: tuple[str, ...] = ()
) -> Check:
    """Bind a rule to paths "table.key"."""
    return Check(rule=rule, needs=needs, when=when, moot=moot)


class _Values:
    """Values of a condition as attributes, by their keys: made thousands of times, so that it is bare."""


class _Written:
    """A value in the text of an error: {outer_radius:mm} has the unit, other formats are Python's."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __format__(self, form: str) -> str:
        """Text of the value."""
        return written(self.value, form) if form in _DIMENSIONS else format(self.value, form)


def condition(
    name: str,
    *needs: str,
    holds: Callable[[Any], bool],
    problem: str,
    allowed: str,
    more: Callable[[Any], Mapping[str, Any]] | None = None,
    when: Callable[[SceneReading], bool] = lambda _: True,
    moot: tuple[str, ...] = (),
) -> Check:
    """Check of a condition on values by the keys of `needs`, such as v.outer_radius, with texts of its error.

    Args: `name`: for `moot` of others. `problem`, `allowed`: values by their keys in braces, see `_Written`.
        `more`: further values, such as a limit, from those of the keys.
    """

    keys = [path.split(".")[1] for path in needs]

    def rule(*arguments: Any) -> Contradiction | None:
        values = _Values()
        vars(values).update(zip(keys, arguments, strict=True))
        if more:
            vars(values).update(more(values))
        if holds(values):
            return None
        texts = {key: _Written(value) for key, value in vars(values).items()}
        return Contradiction(problem=problem.format(**texts), allowed=allowed.format(**texts))

    rule.__name__ = name
    return Check(rule=rule, needs=needs, when=when, moot=moot)


def failed_checks(reading: SceneReading, checks: tuple[Check, ...]) -> Iterator[Fault]:
    """One error for each check that fails; `checks` in order, each after those that make it moot."""
    failed: set[str] = set()
    for each in checks:
        if not reading.known(*each.needs) or not each.when(reading) or (failed and failed & set(each.moot)):
            continue
        finding = each.rule(*[reading.values[path] for path in each.needs])
        if finding is not None:
            failed.add(each.rule.__name__.removeprefix("_"))
            yield reading.fault(each.needs[0], problem=finding.problem, allowed=finding.allowed)


def reader_of(schema: Schema, checks: tuple[Check, ...]) -> Read:
    """Reader of a kind of scene that has only keys and rules."""

    def read(content: SceneInput) -> tuple[SceneReading, tuple[Fault, ...]]:
        reading, faults = content.read(schema)
        reading = reading.completed()
        return reading, (*faults, *reading.missing_faults(), *failed_checks(reading, checks))

    return read


def limit_above_noise(limit: str, noise: str, unit: str) -> Check:
    """Check that a limit is above the standard deviation of the sensor noise, both by their paths."""
    key = noise.split(".")[1]
    return condition(
        "limit_above_noise",
        limit,
        noise,
        holds=lambda v: v.limit > getattr(v, key),
        problem=f"the limit is below the sensor noise ({key} {{{key}:{unit}}})",
        allowed=f"above {{{key}:{unit}}}",
    )
