"""Data that a scene of any balancer keeps of its file: names, hashes, and the origin of each value.

`Measured` has the measurements that the scene was fitted to; no result depends on it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Literal, Self, TypeVar, cast

from ringbalance.scene.fitted import Fitted
from ringbalance.scene.keys.declaration import Listed, Shown, needed, standard, unused
from ringbalance.scene.keys.fields import Bounds, OneLine, each_of, number, whole
from ringbalance.scene.loop_models import RunSettings
from ringbalance.scene.registry import registered
from ringbalance.scene.toml import TableText

Number = Annotated[float, number(Bounds())]
Numbers = Annotated[tuple[float, ...], each_of(number(Bounds()), example="[1.4, 1.5, 1.6]")]


@dataclass(frozen=True, kw_only=True)
class MeasuredFile:
    """One file of measurements."""

    file: Annotated[OneLine, needed("name, without its folder")]
    kind: Annotated[OneLine, needed("of its measurements")]
    rows: Annotated[int, whole(1, 10**9), needed("number of measurements")]
    sha256: Annotated[OneLine, needed("of its bytes")]


@dataclass(frozen=True, kw_only=True)
class _MeasuredQuantity:
    """One quantity of the scene before and after the fit; intervals are those of 95 %."""

    quantity: Annotated[OneLine, needed('its path, such as "tube.bore"')]
    unit: Annotated[OneLine, needed("of the numbers beside it; 1 for none")]
    before: Annotated[Number, needed("value before the fit")]
    before_low: Annotated[Number | None, unused("nothing was known", "lower end of its interval")] = None
    before_high: Annotated[Number | None, unused("nothing was known", "upper end of its interval")] = None
    value: Annotated[Number, needed("fitted value")]
    low: Annotated[Number | None, unused("the data set no end", "lower end of its interval")] = None
    high: Annotated[Number | None, unused("the data set no end", "upper end of its interval")] = None
    verdict: Annotated[OneLine, needed("whether the data identify it")]
    profile: Annotated[Numbers, unused("none", "values at which the likelihood was searched")] = ()
    rise: Annotated[
        Numbers,
        unused("none", "at each of them, minus two log likelihood above its least, over the 95 % one"),
    ] = ()


@dataclass(frozen=True, kw_only=True)
class MeasuredFinding:
    """One sentence about the fit."""

    about: Annotated[OneLine, needed('"combination", "correlation", "residuals", "uncertainty" or "value"')]
    text: Annotated[OneLine, needed("what was found")]


@dataclass(frozen=True, kw_only=True)
class Measured:
    """Data, fit and findings of `ringbalance fit --save`."""

    files: Annotated[
        tuple[MeasuredFile, ...],
        standard([], "files of measurements"),
        Listed('[{ file = "run.csv", kind = "injection", rows = 40, sha256 = "..." }, ...]'),
    ] = ()
    quantities: Annotated[
        tuple[_MeasuredQuantity, ...],
        standard([], "quantities before and after"),
        Listed(
            '[{ quantity = "tube.bore", unit = "mm", before = 1.5, value = 1.48, verdict = "identified" }, '
            "...]"
        ),
    ] = ()
    findings: Annotated[
        tuple[MeasuredFinding, ...],
        standard([], "what else was found"),
        Listed('[{ about = "residuals", text = "..." }, ...]'),
    ] = ()


Origin = Literal["given", "inferred", "assumed", "measured"]
"""Stated in the machine's documents; inferred from other values; chosen, as nothing is known; measured."""
ShownOrigin = Origin | Literal["derived", "default"]
"""`Origin`, or "derived": of the mesh or the valve that the scene names; or "default": not in the file."""
VECTOR_KEYS = {
    "rotor.initial_amplitude": "rotor.initial_vibration",
    "rotor.initial_phase": "rotor.initial_vibration",
    "sensor.runout_amplitude": "sensor.runout",
    "sensor.runout_phase": "sensor.runout",
}
"""Path of the key whose value has an amplitude and a phase, by path of a record's field."""
KEY_OF_FIELD = {
    **VECTOR_KEYS,
    "tolerance": "accuracy.tolerance",
    "disc.geometry": "disc.mesh",
}
"""Path of the key from which a field of another name is read."""


@dataclass(frozen=True, kw_only=True)
class InputUncertainty:
    """Expanded uncertainty (95 %) of one scene quantity."""

    quantity: str
    """Key, such as "bore" or "lag_angle"; where tables share keys its path, such as "rotor.mass"."""
    half_width: float
    """Relative when `relative`, else SI."""
    relative: bool

    def absolute(self, value: float) -> float:
        """Half-width in the unit of the quantity, whose value is given in SI."""
        return self.half_width * (abs(value) if self.relative else 1.0)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class CheckedValues:
    """Values as they were read and checked: a record that differs was changed without a check."""

    document: Mapping[str, Any]
    """Content of the scene file, parsed from TOML."""
    folder: Path
    """Folder from which a mesh is read, absolute path."""
    parts: Mapping[str, object]
    """Fields of the scene by name, without `checked`."""
    derived: Mapping[str, Any]
    """Values that the mesh of a chamber gives, SI, by path."""
    tables: Mapping[str, Any]
    """The document's tables by name, see `keys.reading.TableRead`."""

    @cached_property
    def texts(self) -> Mapping[str, TableText]:
        """The document's tables as TOML, by name."""
        tables = {name: table for name, table in self.document.items() if isinstance(table, dict)}
        return {name: TableText(name=name, content=table) for name, table in tables.items()}


@dataclass(frozen=True, kw_only=True)
class SceneFile:
    """Fields that scenes of all kinds of balancer have."""

    name: str
    run: RunSettings
    tolerance: Annotated[float, Shown("tolerance", "%", dimension="share")]
    """Relative: bounds discretisation and left-out terms."""
    source: str
    """File name without its folder; for the evidence, which is the same wherever the file stands."""
    file: str = field(compare=False)
    """The file as it was named; for messages."""
    sha256: str
    """SHA-256 of the scene file's bytes."""
    values_sha256: str = ""
    """SHA-256 of the values that decide results, defaults included; not of remarks, names and origins."""
    defaulted: tuple[str, ...] = ()
    """Paths such as "rotor.lag_angle" whose value is a default, because the file does not give it."""
    measured: Measured = field(default_factory=Measured)
    fitted: Fitted = field(default_factory=Fitted)
    """Joint distribution of the inputs that were fitted together."""
    origins: tuple[tuple[str, ShownOrigin], ...] = ()
    """Origin of each key by path; empty for a scene that was not read from a file."""
    checked: CheckedValues | None = field(default=None, compare=False, repr=False)
    """None for a scene that was not read from a file."""
    uncertainty: tuple[InputUncertainty, ...] = ()
    """Uncertainties of its inputs, as the file states them."""
    balancer: ClassVar[str]
    """Kind of balancer, as the scene file names it."""

    @property
    def mesh_digest(self) -> str:
        """SHA-256 of the mesh of a chamber; empty without one."""
        return ""

    @property
    def remark(self) -> str:
        """Conversion or default that a command says when it reads the file; empty: none."""
        return ""

    def __repr__(self) -> str:
        """Name, file and hash; the values are its fields."""
        lines = registered("function", "scene_lines")(self)
        return summary_text((f"Scene {self.name!r} ({self.source}, SHA-256 {self.sha256[:12]})", *lines))

    def with_values(self, values: Mapping[str, object], *, origin: Origin = "given") -> Self:
        """The scene with other values, checked as a file is checked, with hashes of its own.

        Values that are derived from a changed one, such as defaults, are derived again.
        Args: `values`: by path in a scene file, such as "tube.bore": text with a unit ("2 mm"), a number in
            SI, or a quantity of pint's; None removes a key. A number of the package uncertainties also
            states its expanded uncertainty (95 %) in [uncertainty]. `origin`: of all of them.
        Raises: SceneError: all errors of the result; or this record was itself changed in another way.
        """
        return cast(Self, registered("function", "with_values")(self, values, origin=origin))

    def origin_of(self, path: str) -> ShownOrigin:
        """Origin of the value at a path such as "tube.bore".

        Returns: What the table's `origin` states, "given" where it states nothing, "derived" for a dimension
            of a mesh, and "default" for a value that the file does not give.
        Raises: ValueError: a scene file has no such key.
        """
        if not self.origins:
            return "given"
        origin = dict(self.origins).get(KEY_OF_FIELD.get(path, path))
        if origin is None:
            raise ValueError(f"a scene file has no key {path!r}")
        return origin


def summary_text(lines: Iterable[str]) -> str:
    """Text of a title and of indented lines below it."""
    title, *others = lines
    return "\n".join([title, *(f"  {line}" for line in others)])


_SomeScene = TypeVar("_SomeScene", bound=SceneFile)
_PATH: Final = re.compile(r"(\w+)\.(\w+)(?:\[(\d+)\])?")


def value_at(scene: SceneFile, path: str) -> float:
    """Number at a path such as "tube.bore", SI."""
    return float(raw_value_at(scene, path))


def raw_value_at(scene: SceneFile, path: str) -> Any:
    """Value at a path in its own type: number, text, whole list or None."""
    table, key, entry = _placed(path)
    value = getattr(getattr(scene, table), key)
    return value if entry is None else value[entry]


def with_values_at(scene: _SomeScene, values: Mapping[str, Any]) -> _SomeScene:
    """A copy with other values by path, texts and whole lists as they are; nothing is checked again.

    A number replaces one entry of a list, or every one where the path names none.
    """
    for path, value in values.items():
        table, key, entry = _placed(path)
        record, new = getattr(scene, table), value
        before = getattr(record, key)
        if isinstance(value, int | float) and isinstance(before, tuple):
            new = tuple(value if entry in (None, i) else each for i, each in enumerate(before))
        changed: dict[str, Any] = {table: replace(record, **{key: new})}
        scene = replace(scene, **changed)
    return scene


def moved_at(scene: _SomeScene, path: str, move: Callable[[float], float]) -> _SomeScene:
    """A copy with one value changed by `move`; all of a list where the path has no index."""
    before = raw_value_at(scene, path)
    after = tuple(map(move, before)) if isinstance(before, tuple) else move(before)
    return with_values_at(scene, {path: after})


def _placed(path: str) -> tuple[str, str, int | None]:
    match = _PATH.fullmatch(path)
    if match is None:
        raise ValueError(f"{path!r} is no path of a scene")
    return match[1], match[2], None if match[3] is None else int(match[3])
