"""Declarations of keys of a scene file: each key once, in the annotation of a record's field.

    bore: Annotated[PositiveLength, needed("inner diameter d"), UNCERTAIN, Shown("bore d", "mm")]

A field is a key when its annotation holds a `Presence`. Accepted values are those of the annotation's
`ValueReader`, or follow from the type: a `Literal`, a record, or a tuple of records. Reading, defaults,
uncertainties, descriptions and the reference in the documentation derive from these declarations.  Values are
SI: in the first unit of the reader's dimension in `DIMENSIONS`.  Modules with such records do not use
`from __future__ import annotations`, because each annotation would be compiled again at every start.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import KW_ONLY, dataclass, is_dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Literal, TypeVar, get_args, get_origin, get_type_hints

from ringbalance.scene.keys.fields import ValueReader, choice
from ringbalance.scene.units import DIMENSIONS, unit_of

Part = TypeVar("Part")


@dataclass(frozen=True, kw_only=True)
class Presence:
    """Meaning of a key, and the rule when it is absent."""

    kind: Literal["needed", "standard", "derived", "unused"]
    """Needed always; with a default; derived from other keys; or, if absent, leaving out its term."""
    meaning: str
    default: object = None
    """Default value as a user would write it."""
    otherwise: str = ""
    """Rule that holds when the key is left out, in words."""
    rule: Callable[..., Any] | None = None
    """Default as a function of the values of `needs`, may return None; without a rule it is their value."""
    needs: tuple[str, ...] = ()
    """Paths "table.key" from which the value is derived; empty when other code fills it in."""
    also: tuple[str, ...] = ()
    """Further paths from which it is derived; None for an absent value."""

    def value(self, *values: Any) -> Any:
        """Value derived from those of `needs`; None when the rule gives none."""
        return values[0] if self.rule is None else self.rule(*values)


@dataclass(frozen=True, kw_only=True)
class Entries:
    """A key whose value is one table, or a list of tables, read into records."""

    record: Callable[..., Any]
    keys: Mapping[str, Key]
    example: str
    """The list as a user would write it; empty for one table."""
    dimension: ClassVar[str | None] = None

    @property
    def allowed(self) -> str:
        """Accepted values, for messages."""
        return self.example or f"a table with {', '.join(self.keys)}"

    @property
    def summary(self) -> str:
        """Form of the value, for the reference of the scene file."""
        return "a list of tables" if self.example else "a table"


@dataclass(frozen=True, kw_only=True)
class Key:
    """One key of a scene file."""

    takes: ValueReader | Entries
    presence: Presence
    uncertain: bool = False
    """True if [uncertainty] may state its half-width."""
    common: bool = False
    """True if all devices of a scene have the same value, whose uncertainty is lack of knowledge."""
    shown_unit: str = ""
    """Unit in descriptions; empty where the declaration has none."""

    @property
    def usual_unit(self) -> str:
        """Unit in which users write the value; empty without unit."""
        if self.takes.dimension is None:
            return ""
        kind = DIMENSIONS[self.takes.dimension]
        return self.shown_unit if self.shown_unit in kind.units else unit_of(kind.example)


@dataclass(frozen=True)
class Shown:
    """Description of a field in reports and messages."""

    name: str
    """Name with symbol, such as "outer radius R2"."""
    unit: str = ""
    _: KW_ONLY
    note: str = ""
    absent: str = ""
    """Text in place of an absent value; empty: no line."""
    only_for: str = ""
    """Control algorithm for which the field is described; empty for all."""
    dimension: str | None = None
    """A key of `DIMENSIONS`; None for that of the field's reader."""


@dataclass(frozen=True)
class Listed:
    """Marks a key that takes a list of tables, such as the example."""

    example: str


@dataclass(frozen=True)
class _Uncertain:
    """Marks a quantity whose uncertainty may be given."""

    common: bool


UNCERTAIN = _Uncertain(common=False)
"""Mark of a quantity that varies from device to device."""
UNKNOWN = _Uncertain(common=True)
"""Mark of a quantity with one value for all devices that is not known exactly."""


def needed(
    meaning: str, *needs: str, otherwise: str = "**needed**", rule: Callable[..., Any] | None = None
) -> Presence:
    """Declare a key that every scene must have.

    Args: `needs`, `otherwise`, `rule`: see `derived`; for a key that is derived where those others are given.
    """
    return Presence(kind="needed", meaning=meaning, otherwise=otherwise, rule=rule, needs=needs)


def standard(default: object, meaning: str) -> Presence:
    """Declare a key with a default, written as by a user."""
    return Presence(kind="standard", meaning=meaning, default=default)


def derived(
    otherwise: str,
    meaning: str,
    *needs: str,
    also: tuple[str, ...] = (),
    rule: Callable[..., Any] | None = None,
) -> Presence:
    """Declare a key whose default is derived from the paths `needs`; `otherwise` describes the rule.

    Args: `also`: paths of further arguments of the rule, None where absent. `rule`: a function with a name:
        a lambda in an annotation does not see its module.
    """
    return Presence(kind="derived", meaning=meaning, otherwise=otherwise, rule=rule, needs=needs, also=also)


def unused(otherwise: str, meaning: str) -> Presence:
    """Declare a key without which the model leaves out a term; `otherwise` describes that case."""
    return Presence(kind="unused", meaning=meaning, otherwise=otherwise)


@cache
def keys_of(record: type) -> Mapping[str, Key]:
    """Keys that the fields of a record declare, in order."""
    hints = get_type_hints(record, include_extras=True)
    return MappingProxyType(
        {
            name: Key(
                takes=_takes(hint),
                presence=presence,
                uncertain=(mark := _part(hint, _Uncertain)) is not None,
                common=mark is not None and mark.common,
                shown_unit=shown.unit if (shown := _part(hint, Shown)) is not None else "",
            )
            for name, hint in hints.items()
            if (presence := _part(hint, Presence)) is not None
        }
    )


@cache
def descriptions_of(record: type) -> Mapping[str, Shown]:
    """Descriptions that the fields of a record have, in order."""
    hints = get_type_hints(record, include_extras=True)
    shown = {name: _part(hint, Shown) for name, hint in hints.items()}
    return MappingProxyType({name: entry for name, entry in shown.items() if entry is not None})


def _part(hint: Any, kind: type[Part]) -> Part | None:
    return next((each for each in _parts(hint) if isinstance(each, kind)), None)


def _parts(hint: Any) -> Iterator[Any]:
    """Types and metadata inside an annotation, nested ones included."""
    yield hint
    for inner in get_args(hint):
        yield from _parts(inner)


def _takes(hint: Any) -> ValueReader | Entries:
    for part in _parts(hint):
        if isinstance(part, ValueReader):
            return part
        if get_origin(part) is Literal:
            return choice(part)
        if isinstance(part, type) and is_dataclass(part):
            listed = _part(hint, Listed)
            return Entries(record=part, keys=keys_of(part), example=listed.example if listed else "")
    raise TypeError(f"{hint} does not declare what its key takes")
