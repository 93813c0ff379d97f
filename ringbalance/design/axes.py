"""Axes of a sweep: keys of a scene over a range or a list, several together, or whole tables of a CSV.

An axis is written KEY=VALUES, where VALUES is a range `LOW:HIGH:COUNT`, even steps, or `LOW:HIGH:COUNT:log`;
a list `A,B,C`; or, for the name of a table, a CSV file whose columns are keys of that table and whose rows
are alternatives.  Keys that vary together form one axis: `tube.bore=1mm,2mm,tube.length=0.3m,0.4m`.
A key that takes a list has lists: `masses.friction_arm=[60um,60um],[80um,80um]`.  A sample needs no COUNT.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.design.choices import NAME, as_toml, read_choices
from ringbalance.results.numbers import format_given, plain
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.draws import quantiles
from ringbalance.scene.faults import Fault, SceneError, did_you_mean
from ringbalance.scene.keys.fields import ValueReader
from ringbalance.scene.keys.schema import ORIGIN, Schema
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.platform.files import NOT_TEXT
from ringbalance.scene.registry import registered
from ringbalance.scene.toml import read_toml
from ringbalance.scene.units import DIMENSIONS, FieldError

Point = Mapping[str, Any]
"""Changed values by path, as `SceneFile.with_values` takes them: SI, or text."""

MAX_POINTS: Final = 1_000_000
_COMMA: Final = re.compile(r",(?![^\[]*\])")
"""Comma outside of a list in brackets."""
_SAMPLES: Final = ("sobol", "latin")
_OFTEN_WRONG_DIMENSIONS: Final = frozenset({"length", "pressure"})
"""Dimensions whose numbers are often entered in a unit other than SI, such as mm or bar."""
_FAR_FACTOR: Final = 100.0
"""Ratio of all values of a sweep to the scene's value beyond which they count as in a wrong unit."""


@dataclass(frozen=True, kw_only=True)
class Range:
    """A key between two values, SI."""

    low: float
    high: float
    count: int | None = None
    """Number of evenly spaced values; None: usable in a sample only."""
    log: bool = False
    """True if the steps are even in the logarithm."""

    def at(self, share: FloatArray) -> FloatArray:
        """Values at fractions of the range, in [0, 1]; exact at both ends."""
        low, high = (math.log(end) if self.log else end for end in (self.low, self.high))
        value = low + share * (high - low)
        inner = np.exp(value) if self.log else value
        return np.where(share == 0, self.low, np.where(share == 1, self.high, inner))

    def share(self, value: float) -> float:
        """Fraction of the range at a value, clipped to [0, 1]."""
        low, high, at = (math.log(each) if self.log else each for each in (self.low, self.high, value))
        return min(max((at - low) / (high - low), 0.0), 1.0)


@dataclass(frozen=True, kw_only=True)
class SweepAxis:
    """Keys that vary together."""

    ranges: Mapping[str, Range]
    """Ranges by path; empty for a list."""
    choices: tuple[Point, ...] = ()
    """Values of a list, in its order."""
    names: tuple[str, ...] = ()
    """Names of the rows of a CSV file; empty if it has no names."""

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the keys."""
        return tuple(self.ranges or dict.fromkeys(path for each in self.choices for path in each))

    @property
    def head(self) -> str:
        """Key that represents the axis: such as "gas.name" if its rows have names, else its first key."""
        return f"{self.paths[0].partition('.')[0]}.{NAME}" if self.names else self.paths[0]

    def name_of(self, point: Point) -> str:
        """Name of the row with the values of a point; empty if there is none."""
        return self._name_by_values.get(tuple(map(point.get, self.paths)), "")

    @cached_property
    def _name_by_values(self) -> Mapping[tuple[Any, ...], str]:
        rows = [tuple(map(each.get, self.paths)) for each in self.choices]
        # Rows with equal values have the name of the first.
        return dict(reversed([*zip(rows, self.names, strict=False)]))

    def grid(self) -> tuple[Point, ...]:
        """Every value of the axis. Raises: SceneError: a range without COUNT."""
        if not self.ranges:
            return self.choices
        counts = {each.count for each in self.ranges.values()}
        (count,) = counts if len(counts) == 1 else (None,)
        if count is None:
            raise _fault(self.paths[0], "a grid needs as many steps of each key", "LOW:HIGH:COUNT")
        return self.at(np.linspace(0.0, 1.0, count) if count > 1 else np.zeros(1))

    def at(self, shares: FloatArray) -> tuple[Point, ...]:
        """Values at fractions of the axis, in [0, 1]."""
        if not self.ranges:
            numbers = np.minimum(shares * len(self.choices), len(self.choices) - 1).astype(int)
            return tuple(self.choices[number] for number in numbers.tolist())
        columns = {path: each.at(shares).tolist() for path, each in self.ranges.items()}
        return tuple(dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Axes, with the rule that takes points from them: grid or sample."""

    axes: tuple[SweepAxis, ...]
    sample: str = ""
    """ "sobol:1024" or "latin:1024"; empty: every combination."""

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of all keys that vary."""
        return tuple(path for axis in self.axes for path in axis.paths)

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the axes of a grid; for a sample, its number of points."""
        return (len(self.points()),) if self.sample else tuple(len(axis.grid()) for axis in self.axes)

    def points(self) -> tuple[Point, ...]:
        """All points; in a grid the last axis varies fastest.

        Raises: SceneError: no axis, too many points, or an invalid sample.
        """
        if not self.axes:
            raise _fault("", "nothing varies", 'at least one axis, such as "tube.bore=0.5mm:2mm:30"')
        if len(set(self.paths)) < len(self.paths):
            twice = next(path for path in self.paths if self.paths.count(path) > 1)
            raise _fault(twice, "it varies twice", "each key in one axis")
        if self.sample:
            kind, count = _sample_size(self.sample)
            shares: FloatArray
            if kind == "latin":
                numbers = range(len(self.axes))
                shares = np.stack([quantiles(f"axis {i}", range(count), seed=0) for i in numbers], axis=-1)
            else:
                shares = registered("function", "sobol")(len(self.axes), count)
            parts = [axis.at(column) for axis, column in zip(self.axes, shares.T, strict=True)]
            return tuple(_merged(row) for row in zip(*parts, strict=True))
        grids = [axis.grid() for axis in self.axes]
        if (count := math.prod(map(len, grids))) > MAX_POINTS:
            raise _fault("", f"{count} points", f"at most {MAX_POINTS}; a sample takes as many as it says")
        return tuple(map(_merged, product(*grids)))


def _merged(parts: Sequence[Point]) -> Point:
    return {path: value for part in parts for path, value in part.items()}


def _sample_size(sample: str) -> tuple[str, int]:
    """Kind and number of points of a sample. Raises: SceneError: an invalid sample."""
    kind, _, text = sample.partition(":")
    if kind not in _SAMPLES or not text.isdecimal() or not 1 <= int(text) <= MAX_POINTS:
        allowed = f"one of {', '.join(f'{each}:N' for each in _SAMPLES)} with at most {MAX_POINTS} points"
        problem = "this is no sample"
        raise SceneError.of_option(option="--sample", value=sample, problem=problem, allowed=allowed)
    return kind, int(text)


def plan_of(scene: SceneFile, vary: Mapping[Any, Any], *, sample: str = "") -> Plan:
    """Plan from values in Python.

    Args: `vary`: by path, an array, SI, a list of values as in a scene file, or the VALUES of an axis as
        text; by a tuple of k paths, one such list for each path, or an array of shape (points, k); by the
        name of a table, a list of mappings from its keys, or a CSV file.
    Raises: SceneError: all errors of the axes together.
    """
    return _plan([partial(_axis_of, scene, name, values) for name, values in vary.items()], sample)


def plan_of_texts(
    scene: SceneFile, texts: Sequence[str], *, sample: str = "", folder: Path | None = None
) -> Plan:
    """Plan from axes as on the command line, each KEY=VALUES; see `plan_of`.

    Args: `folder`: folder of the CSV files that axes name; default the working folder.
    """
    return _plan([partial(_axis_of_text, scene, each, folder=folder or Path()) for each in texts], sample)


def _plan(axes: Iterable[Callable[[], SweepAxis]], sample: str) -> Plan:
    """Make a plan from axes. Raises: SceneError: all errors of the axes together."""
    plan_axes: list[SweepAxis] = []
    faults: list[Fault] = []
    for axis in axes:
        try:
            plan_axes.append(axis())
        except SceneError as error:
            faults += error.faults
    if faults:
        raise SceneError(faults)
    return Plan(axes=tuple(plan_axes), sample=sample)


def plan_of_file(scene: SceneFile, file: Path) -> Plan:
    """Plan from a TOML file with `vary`, a list of axes as on the command line, and `sample`.

    Raises: SceneError: the file cannot be read or has errors.
    """
    if not file.is_file():
        raise SceneError.of_file(str(file), "there is no such file", "a TOML file with vary and sample")
    try:
        content = read_toml(file.read_text(encoding="utf-8"))
    except UnicodeDecodeError as error:
        raise SceneError.of_file(str(file), NOT_TEXT, "a TOML file with vary and sample") from error
    except (OSError, ValueError, RecursionError) as error:
        raise SceneError.of_file(str(file), f"the plan cannot be read: {error}") from error
    texts, sample = content.pop("vary", None), content.pop("sample", "")
    faults = [
        (name, f"unknown key{did_you_mean(name, ('vary', 'sample'))}", "vary and sample") for name in content
    ]
    if not isinstance(texts, list) or not all(isinstance(each, str) for each in texts):
        faults.append(("vary", "it is no list of axes", '["tube.bore=0.5mm:2mm:30"]'))
    if not isinstance(sample, str):
        faults.append(("sample", "it is no text", '"sobol:64"'))
    if faults:
        raise SceneError(
            Fault(file=str(file), key=name, problem=problem, allowed=allowed)
            for name, problem, allowed in faults
        )
    try:
        plan = plan_of_texts(scene, texts, sample=sample, folder=file.parent)
        if sample:
            _sample_size(sample)
    except SceneError as error:
        raise error.as_keys_of(str(file)) from error
    return plan


def _axis_of_text(scene: SceneFile, text: str, *, folder: Path) -> SweepAxis:
    """Read one KEY=VALUES, or several separated by commas."""
    keys: list[tuple[str, list[str]]] = []
    for part in _COMMA.split(text):
        path, equals, value = part.partition("=")
        if equals:
            keys.append((path.strip(), [value.strip()]))
        elif keys:
            keys[-1][1].append(part.strip())
        else:
            raise _fault(text, "no key stands before a sign =", "KEY=VALUES, such as tube.bore=0.5mm:2mm:30")
    if len(keys) == 1 and keys[0][0] in scene_kind(scene.balancer).schema.tables:
        return _table_axis(scene, keys[0][0], folder / keys[0][1][0], shown=keys[0][1][0])
    return _linked([_values(scene, path, values) for path, values in keys], keys[0][0])


def _axis_of(scene: SceneFile, name: Any, values: Any) -> SweepAxis:
    if isinstance(name, tuple):
        keys, shape = ", ".join(map(str, name)), tuple(getattr(values, "shape", ()))
        if shape == (len(name), len(name)) and len(name) > 1:
            problem = "in a square array the rows may be points or keys"
            raise _fault(keys, problem, "a list with an array for each key, such as list(points.T)")
        if len(shape) == 2 and shape[1] == len(name):
            values = np.asarray(values).T
        if len(name) != len(values):
            what = f"an array of shape {shape}" if shape else f"{len(values)} lists of values"
            raise _fault(keys, what, "one for each key, or an array with a row for each point")
        return _linked([_values(scene, path, each) for path, each in zip(name, values, strict=True)], name[0])
    if name in scene_kind(scene.balancer).schema.tables:
        if isinstance(values, str | Path):
            return _table_axis(scene, name, Path(values), shown=str(values))
        # The rows of a pandas table, or a single row.
        values = values.to_dict("records") if hasattr(values, "to_dict") else values
        values = [values] if isinstance(values, Mapping) else values
        if not all(isinstance(row, Mapping) for row in values):
            raise _fault(name, "its rows are no mappings", "a list of mappings from keys, or a CSV file")
        named = NAME not in scene_kind(scene.balancer).schema.tables[name].keys
        names = [str(row[NAME]) for row in values if named and NAME in row]
        rows = [
            {f"{name}.{key}": value for key, value in row.items() if not (named and key == NAME)}
            for row in values
        ]
        readers = {path: _reader(scene, path) for row in rows for path in row}
        choices = (
            {path: _checked(path, value, readers[path]) for path, value in row.items()} for row in rows
        )
        every_name = tuple(names) if len(names) == len(rows) else ()
        return SweepAxis(ranges={}, choices=tuple(choices), names=every_name)
    return _linked([_values(scene, name, values)], name)


def _linked(parts: Sequence[tuple[str, Range | list[Any]]], path: str) -> SweepAxis:
    """Axis of keys that vary together: all over ranges, or all over lists of equal length."""
    ranges = {path: each for path, each in parts if isinstance(each, Range)}
    lists = {path: each for path, each in parts if isinstance(each, list)}
    if not lists:
        return SweepAxis(ranges=ranges)
    if not all(lists.values()):
        raise _fault(path, "no value stands there", "at least one")
    if ranges or len({len(each) for each in lists.values()}) != 1:
        raise _fault(path, "keys of one axis differ in kind or number of values", "as many values of each")
    rows = zip(*lists.values(), strict=True)
    return SweepAxis(ranges={}, choices=tuple(dict(zip(lists, row, strict=True)) for row in rows))


def _values(scene: SceneFile, path: str, values: Any) -> tuple[str, Range | list[Any]]:
    """Range or list of a key, read by the key's own reader."""
    reader = _reader(scene, path)
    if isinstance(values, str):
        values = _COMMA.split(values)
    values = values.tolist() if hasattr(values, "tolist") else values
    values = list(values) if isinstance(values, Iterable) else [values]
    _check_scale(scene, path, values, reader)
    if len(values) != 1 or not isinstance(values[0], str) or ":" not in values[0]:
        return path, [_checked(path, each, reader) for each in values]
    low, high, *more = values[0].split(":")
    log = bool(more) and more[-1] == "log"
    counts = more[:-1] if log else more
    if len(counts) > 1 or not all(each.isdecimal() and int(each) > 0 for each in counts):
        problem = "the number of values must be whole and above 0" if len(counts) == 1 else "this is no range"
        raise _fault(f"{path}={values[0]}", problem, "LOW:HIGH:COUNT or LOW:HIGH:COUNT:log")
    ends = [_read(path, end, reader) for end in (low, high)]
    if not all(isinstance(end, float) for end in ends) or (log and min(ends) <= 0):
        raise _fault(f"{path}={values[0]}", "this key has no such range", "a list A,B,C")
    count = int(counts[0]) if counts else None
    return path, Range(low=ends[0], high=ends[1], count=count, log=log)


def _check_scale(scene: SceneFile, path: str, values: Sequence[Any], reader: ValueReader) -> None:
    """Refuse bare numbers that all differ from the scene's value by more than `_FAR_FACTOR`: a wrong unit."""
    table, _, key = path.partition(".")
    scene_value, dimension = getattr(getattr(scene, table), key, None), reader.dimension
    bare = bool(values) and all(isinstance(each, int | float) and each > 0 for each in values)
    comparable = isinstance(scene_value, float) and scene_value > 0
    if dimension not in _OFTEN_WRONG_DIMENSIONS or not bare or not comparable:
        return
    ratios = [each / scene_value for each in values]
    if min(ratios) > _FAR_FACTOR or max(ratios) < 1 / _FAR_FACTOR:
        unit = unit_of_path(scene, path)
        text = plain(format_given(scene_value, unit))
        problem = f"bare numbers are in {unit}, and all are far from the scene's {text}"
        allowed = f'numbers in {unit}, or text with its unit, as "{text}"'
        raise _fault(f"{path}={values[0]:g}", problem, allowed)


def _read(path: str, text: str, reader: ValueReader) -> Any:
    try:
        return reader.read(as_toml(text, reader))
    except FieldError as error:
        raise _fault(f"{path}={text}", error.problem, error.allowed) from error


def _checked(path: str, value: Any, reader: ValueReader) -> Any:
    """Checked value of a list, a number in SI or text."""
    if not isinstance(value, str):
        return value
    read = _read(path, value, reader)
    # A tolerance reads as a number with its kind, a truth value: it stays as it was written.
    kind = isinstance(read, tuple) and any(isinstance(each, bool) for each in read)
    return read if isinstance(read, int | float | tuple) and not kind else value


def _reader(scene: SceneFile, path: str) -> ValueReader:
    """Reader of a key. Raises: SceneError: no such key in this kind of scene, or a key that holds a table."""
    schema: Schema = scene_kind(scene.balancer).schema
    table, _, key = str(path).partition(".")
    declared = schema.tables[table].keys.get(key) if table in schema.tables else None
    if declared is None or key == ORIGIN or not isinstance(declared.takes, ValueReader):
        paths = [f"{name}.{each}" for name, content in schema.tables.items() for each in content.keys]
        problem = f"a scene of this kind has no such key{did_you_mean(str(path), paths)}"
        raise _fault(str(path), problem, "TABLE.KEY=VALUES, or TABLE=FILE.csv")
    return declared.takes


def _table_axis(scene: SceneFile, table: str, file: Path, *, shown: str) -> SweepAxis:
    """Axis of the rows of a CSV file, each of which sets some keys of a table. Args: `shown`: file name."""
    if not file.is_file():
        raise _fault(f"{table}={shown}", "there is no such file", f"a CSV file with keys of [{table}]")
    keys = scene_kind(scene.balancer).schema.tables[table].keys
    content = read_choices(file, table=table, keys=keys)
    rows = ({f"{table}.{key}": value for key, value in row.items()} for row in content.rows)
    return SweepAxis(ranges={}, choices=tuple(rows), names=content.names)


def unit_of_path(scene: SceneFile, path: str) -> str:
    """SI unit of a key; "1" for one without."""
    dimension = _reader(scene, path).dimension
    return DIMENSIONS[dimension].si_unit if dimension else "1"


def _fault(value: str, problem: str, allowed: str) -> SceneError:
    return SceneError.of_option(option="--vary", value=value, problem=problem, allowed=allowed)
