"""Keys of a scene file as the fields of records declare them: each key once, in its field's annotation.

    bore: Annotated[PositiveLength, needed("inner diameter d"), UNCERTAIN, Shown("bore d", "mm")]

A field is a key when its annotation holds a `Presence`. What may be written there is the `Reader` of the
annotation, or follows from the type: a `Literal`, a record, or a tuple of records. Reading, defaults,
uncertainties, descriptions and the reference in the documentation derive from these declarations.  Values are
SI: in the first unit that `DIMENSIONS` has for the reader's dimension.  Modules with such records do without
`from __future__ import annotations`: each annotation would be compiled again at every start.
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
    """Always needed; with a default value; following from other keys; or leaving out a term."""
    meaning: str
    default: object = None
    """Default value as a user would write it."""
    otherwise: str = ""
    """Rule that holds when the key is left out, in words."""
    rule: Callable[..., Any] | None = None
    """Value that follows from those of `needs`, or None; without a rule it is theirs."""
    needs: tuple[str, ...] = ()
    """Paths "table.key" of what the value follows from; empty when other code fills it in."""
    also: tuple[str, ...] = ()
    """Paths of what it follows from as well where that is there, else None."""

    def value(self, *values: Any) -> Any:
        """Value that follows from those of `needs`; None when there is none in this case."""
        return values[0] if self.rule is None else self.rule(*values)


@dataclass(frozen=True, kw_only=True)
class Entries:
    """A key whose value is one table, or a list of tables, of which records are made."""

    record: Callable[..., Any]
    keys: Mapping[str, Key]
    example: str
    """The list as one would write it; empty for one table."""
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
    """True if [uncertainty] may have its half-width."""
    common: bool = False
    """True if all devices of a scene have it alike: its uncertainty is lack of knowledge."""
    shown_unit: str = ""
    """Unit of its description; empty where its declaration has none."""

    @property
    def usual_unit(self) -> str:
        """Unit in which a person writes its number; empty for what has no unit."""
        if self.takes.dimension is None:
            return ""
        kind = DIMENSIONS[self.takes.dimension]
        return self.shown_unit if self.shown_unit in kind.units else unit_of(kind.example)


@dataclass(frozen=True)
class Shown:
    """Description of a field for a reader."""

    name: str
    """Name with symbol, such as "outer radius R2"."""
    unit: str = ""
    _: KW_ONLY
    note: str = ""
    absent: str = ""
    """Text in place of a value that the scene lacks; empty: no line."""
    only_for: str = ""
    """Control algorithm for which it is described; empty for all."""
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
"""It varies from device to device."""
UNKNOWN = _Uncertain(common=True)
"""All devices have it alike, and it is not known exactly."""


def needed(
    meaning: str, *needs: str, otherwise: str = "**needed**", rule: Callable[..., Any] | None = None
) -> Presence:
    """Declare a key that every scene must have.

    Args: `needs`, `otherwise`, `rule`: as of `derived`, of one that follows where those others are there.
    """
    return Presence(kind="needed", meaning=meaning, otherwise=otherwise, rule=rule, needs=needs)


def standard(default: object, meaning: str) -> Presence:
    """Declare a key with a default, given as a user would write it."""
    return Presence(kind="standard", meaning=meaning, default=default)


def derived(
    otherwise: str,
    meaning: str,
    *needs: str,
    also: tuple[str, ...] = (),
    rule: Callable[..., Any] | None = None,
) -> Presence:
    """Declare a key whose default follows from those at the paths `needs`, as `otherwise` says in words.

    Args: `also`: paths of what comes after them, None where a file lacks it. `rule`: a function with a name:
        a lambda in an annotation does not see its module.
    """
    return Presence(kind="derived", meaning=meaning, otherwise=otherwise, rule=rule, needs=needs, also=also)


def unused(otherwise: str, meaning: str) -> Presence:
    """Declare a key without which a term is left out; `otherwise` says what holds then."""
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
    """Everything inside an annotation: its types, and what was put beside them."""
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
