"""Printed values that carry their place in the evidence, through any text, onto the page."""

from __future__ import annotations

import re
from typing import Any, Final

from markupsafe import Markup, escape

from ringbalance.reduced_model.budget import believed
from ringbalance.reports.numbers import shown
from ringbalance.reports.prose import typeset

_OPEN, _MIDDLE, _CLOSE = "\ue000", "\ue001", "\ue002"
_INDEXED: Final = re.compile(r"(?<![\w.])([A-Za-zα-ωΑ-Ω])_([A-Za-zΩ]{1,3})(?!\w)")
_TRACED: Final = re.compile(f"{_OPEN}([^{_MIDDLE}]*){_MIDDLE}([^{_CLOSE}]*){_CLOSE}")


def traced(text: str, path: str) -> str:
    """A value's text, marked with its dotted place in the evidence, such as "operating_point.k".

    The mark is part of the text, so it survives sentences and tables that are made of it.
    """
    return f"{_OPEN}{path}{_MIDDLE}{text}{_CLOSE}"


def untraced(text: str) -> str:
    """The text alone, for a terminal."""
    return _TRACED.sub(r"\2", text) if _OPEN in text else text


def marked_up(value: object) -> object:
    """Text as it goes onto the page: typeset, traced values in elements that name their place.

    Markup, and what is marked `verbatim`, is left as it is.
    """
    if not isinstance(value, str) or isinstance(value, Markup):
        return value
    if _OPEN not in value:
        return _lowered(typeset(value))
    # Between two traces stands prose; every third part, from the first on, is such.
    parts = _TRACED.split(value)
    found = [escape(_lowered(typeset(parts[0])))]
    for path, text, prose in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
        found.append(Markup('<span data-from="{}">{}</span>').format(path, typeset(text)))
        found.append(escape(_lowered(typeset(prose))))
    return Markup("").join(found)


def _lowered(text: str) -> str:
    """Symbols such as K_B with their index below the line; other text as it is."""
    return Markup(_INDEXED.sub(r"\1<sub>\2</sub>", str(escape(text)))) if _INDEXED.search(text) else text


_DIGITS: Final = 4


def evidence_at(evidence: Any, path: str) -> Any:
    """What the evidence holds at a dotted place; in a list by position, or by the `id` of an item.

    Raises: KeyError, IndexError: nothing is there.
    """
    for key in path.split("."):
        if not isinstance(evidence, list):
            evidence = evidence[key]
        elif key.lstrip("-").isdigit():
            evidence = evidence[int(key)]
        else:
            evidence = {item.get("id"): item for item in evidence}[key]
    return evidence


def found_at(evidence: Any, path: str) -> Any:
    """The same; None where nothing is there."""
    try:
        return evidence_at(evidence, path)
    except (KeyError, IndexError, TypeError):
        return None


def read(evidence: Any, path: str, unit: str, *, width: float | None = None, digits: int = 3) -> str:
    """The evidence's value at a place in the unit that suits it, with its half-width (95 %, SI), traced."""
    value = evidence_at(evidence, path)
    known = believed(value, width, stated=states_uncertainty(evidence))
    return traced(shown(value, unit, known, digits=digits if known == width else _DIGITS), path)


def states_uncertainty(evidence: Any) -> bool:
    """Whether the scene file says of any input how uncertain it is."""
    return bool(evidence.get("scene", {}).get("states_uncertainty"))
