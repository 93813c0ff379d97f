"""Wording of the report: plain text set with proper signs, no number changed; inputs by name and origin; and
printed values that carry their place in the evidence, through any text, onto the page."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from markupsafe import Markup, escape

from ringbalance.results.numbers import believed, shown
from ringbalance.scene.uncertain import FITTED

_GREEK: Final = {
    "alpha": "α",
    "delta": "δ",
    "eps": "ε",
    "eta": "η",
    "kappa": "κ",
    "lambda": "λ",
    "mu": "μ",
    "nu": "ν",
    "omega": "ω",
    "phi": "φ",
    "pi": "π",
    "rho": "ρ",
    "sigma": "σ",
    "theta": "θ",
}
_SUPERSCRIPTS: Final = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_SUBSCRIPTS: Final = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_GREEK_WORD: Final = re.compile(rf"(?<![\w\\])({'|'.join(_GREEK)})(?![a-z])")
_POWER: Final = re.compile(r"\^(?:\((-?\d+)\)|(-?\d+))(?!\.?\d)")
_INDEXED: Final = re.compile(r"\b(?:([RVUxHp])|([A-Za-z])_)(\d)(?:(')|(?!\w))")
_EXPONENT: Final = re.compile(r"(?<=\d)e([+-]\d+)\b")
_UNITS: Final = {
    r"\bum\b": "µm",
    r"\bdegC\b": "°C",
    r"(?<=\d) deg\b": "°",
    r"\bg\*mm\b": "g\u202fmm",
    r"\bl/\(s\*bar\)": "l/(s\u202fbar)",
    r"\br_m\b": "rₘ",
    r"\br_p\b": "rₚ",
    r"\bR_Omega\b": "R_Ω",
    r"\bsqrt(?=\()": "√",
    r"(?<=\d)%": "\u202f%",
    r"\*([A-Za-z][A-Za-z ]*)\*": r"\1",
    r" \+- ": " ± ",
    r" - ": " − ",
    r"'": "’",
}
_PLAIN: Final = re.compile(r"[^A-Za-z^%'*]*")
"""What nothing here changes, unless it has a " - ": most cells of tables."""
_CERTAIN: Final = ("given", "measured")
_OWNERS: Final = {"lqr": "regulator", "masses": "eccentric masses"}
"""What a table of the scene file stands for, where that is another word."""
_ALONE: Final = ("accuracy", "environment", "run", "gas.ambient_pressure")
"""Tables, and a key, whose keys need no owner."""
_MESH: Final = "disc.mesh"
_DIGITS: Final = 4
_OPEN, _MIDDLE, _CLOSE = "\ue000", "\ue001", "\ue002"
_SYMBOL: Final = re.compile(r"(?<![\w.])([A-Za-zα-ωΑ-Ω])_([A-Za-zΩ]{1,3})(?!\w)")
_TRACED: Final = re.compile(f"{_OPEN}([^{_MIDDLE}]*){_MIDDLE}([^{_CLOSE}]*){_CLOSE}")


def typeset(text: str) -> str:
    """Sets plain prose such as "rho omega^2 R2^2 in um" with the signs that it means."""
    if _PLAIN.fullmatch(text) and "- " not in text:
        return text
    greek = _GREEK_WORD.sub(lambda match: _GREEK[match[1]], text)
    indexed = _INDEXED.sub(_index, greek)
    raised = _POWER.sub(lambda match: (match[1] or match[2]).translate(_SUPERSCRIPTS), indexed)
    raised = _EXPONENT.sub(
        lambda match: f"\u202f×\u202f10{str(int(match[1])).translate(_SUPERSCRIPTS)}", raised
    )
    for pattern, sign in _UNITS.items():
        raised = re.sub(pattern, sign, raised)
    return raised


def key_words(path: str) -> str:
    """The key of a path in the scene file as a reader knows it, such as "siphon crest radius"."""
    if path == FITTED:
        return "fitted inputs"
    return path.rpartition(".")[2].replace("_", " ").replace("hump", "siphon crest")


def _index(match: re.Match[str]) -> str:
    return (match[1] or match[2]) + match[3].translate(_SUBSCRIPTS) + ("′" if match[4] else "")


def series(names: list[str]) -> str:
    """Names as a sentence has them: "a, b and c"."""
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)


def resting(evidence: Mapping[str, Any], *paths: str) -> str:
    """The inputs among some that are neither given nor measured, with their origin."""
    origins = evidence["scene"].get("origins") or {}
    by_origin: dict[str, list[str]] = {}
    for named in paths:
        # What follows from the mesh of an imported chamber rests on that.
        path = _MESH if origins.get(named) == "derived" else named
        if (origin := origins.get(path, "given")) not in _CERTAIN:
            by_origin.setdefault(origin, []).append(key_words(path))
    return "; ".join(f"{origin}: {', '.join(names)}" for origin, names in by_origin.items())


def named_with_origin(evidence: Mapping[str, Any], path: str) -> str:
    """An input's name, with its origin where it is neither given nor measured."""
    origin = (evidence["scene"].get("origins") or {}).get(path, "given")
    return input_name(path) + ("" if origin in _CERTAIN else f" ({origin})")


def input_name(path: str) -> str:
    """The name of an input that a path in the scene file stands for, such as "bore of the tube"."""
    if path == FITTED:
        return "what was fitted together"
    table, _, key = path.partition(".")
    owner = _OWNERS.get(table, table.replace("_", " "))
    if not key or path.startswith(_ALONE) or owner in key_words(path).split():
        return key_words(path) if key else path
    return f"{key_words(path)} of the {owner}"


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
    return Markup(_SYMBOL.sub(r"\1<sub>\2</sub>", str(escape(text)))) if _SYMBOL.search(text) else text


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
