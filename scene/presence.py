"""How a key of a scene file may be absent: needed, with a default, following from others, or not used."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo


class Table(BaseModel):
    """A table of a scene file; an unknown key is a fault."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def needed(meaning: str) -> Any:
    """Make a key that every scene must have.

    Args:
        meaning: of the key, for the reference.

    Returns:
        A field of a table.
    """
    return Field(default=None, description=meaning, json_schema_extra=_extra("needed", "needed"))


def standard(value: object, meaning: str) -> Any:
    """Make a key with a default.

    Args:
        value: the default, as a user would write it.
        meaning: of the key, for the reference.

    Returns:
        A field of a table.
    """
    extra = _extra("standard", "")
    return Field(default=value, validate_default=True, description=meaning, json_schema_extra=extra)


def derived(rule: str, meaning: str) -> Any:
    """Make a key whose default follows from other keys.

    Args:
        rule: how it follows, in words.
        meaning: of the key, for the reference.

    Returns:
        A field of a table.
    """
    return Field(default=None, description=meaning, json_schema_extra=_extra("derived", rule))


def unused(rule: str, meaning: str) -> Any:
    """Make a key without which a term is left out.

    Args:
        rule: what holds without it, in words.
        meaning: of the key, for the reference.

    Returns:
        A field of a table.
    """
    return Field(default=None, description=meaning, json_schema_extra=_extra("unused", rule))


def list_of_tables(example: str, meaning: str, *, is_needed: bool = False) -> Any:
    """Make a key that takes a list of tables.

    Args:
        example: the list as one would write it, for messages.
        meaning: of the key, for the reference.
        is_needed: whether every scene must have it; else it is empty when left out.

    Returns:
        A field of a table.
    """
    extra = _extra("needed", "needed") if is_needed else _extra("standard", "[]")
    default = None if is_needed else ()
    return Field(default=default, description=meaning, json_schema_extra={**extra, "list": example})


def presence_of(field: FieldInfo) -> str:
    """Tell how a key may be absent.

    Args:
        field: of one of the tables of a scene file.

    Returns:
        "needed", "standard" (its default is a value), "derived" (follows from others) or "unused" (the
        term is left out); empty for a table.
    """
    return note_of(field, "presence")


def note_of(field: FieldInfo, name: str) -> str:
    """Read a note that was put on a key.

    Args:
        field: of one of the tables of a scene file.
        name: "presence", "rule" or "list".

    Returns:
        The note; empty when there is none.
    """
    extra = field.json_schema_extra
    return str(extra.get(name, "")) if isinstance(extra, dict) else ""


def _extra(presence: str, rule: str) -> dict[str, Any]:
    return {"presence": presence, "rule": rule}
