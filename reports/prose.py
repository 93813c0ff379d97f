"""Wording of the report: plain text and equations set with proper signs; inputs by name and origin."""

from __future__ import annotations

import json
import lzma
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Final, cast

from markupsafe import escape

from ringbalance.results.numbers import SUPERSCRIPTS, power_of_ten
from ringbalance.scene.errors import FITTED

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
"""Text that needs no typesetting unless it has a " - ": most cells of tables."""
_KNOWN_ORIGINS: Final = ("given", "measured")
_OWNERS: Final = {"lqr": "regulator", "masses": "eccentric masses"}
"""Names of tables of the scene file, where they differ from the key."""
_ALONE: Final = ("accuracy", "environment", "run", "gas.ambient_pressure")
"""Tables whose keys need no owner in their names, and one such key."""
_MESH: Final = "disc.mesh"
_KEYS: Final = {
    "pressure": "gas pressure",
    "proportional": "gain",
    "initial_phase": "phase of the initial vibration",
    "gas_time_offset": "offset of the valve-open time",
    "minimum_gas_time": "shortest valve-open time",
    "maximum_gas_time": "longest valve-open time",
    "conductance": "sonic conductance",
    "draw_down_factor": "draw-down factor",
}
"""Words for keys that do not read as words."""
_PATH: Final = re.compile(
    r"\b(?:controller|disc|gas|liquid|masses|requirement|rotor|run|sensor|tube)\.[a-z_]+"
)


def typeset(text: str) -> str:
    """Set plain prose such as "rho omega^2 R2^2 in um" with Greek letters, superscripts and signs."""
    if _PLAIN.fullmatch(text) and "- " not in text:
        return text
    text = _GREEK_WORD.sub(lambda match: _GREEK[match[1]], text)
    text = _INDEXED.sub(
        lambda match: f"{match[1] or match[2]}{match[3].translate(_SUBSCRIPTS)}{'′' if match[4] else ''}",
        text,
    )
    text = _POWER.sub(lambda match: (match[1] or match[2]).translate(SUPERSCRIPTS), text)
    text = _EXPONENT.sub(lambda match: f"\u202f×\u202f{power_of_ten(int(match[1]))}", text)
    for pattern, sign in _UNITS.items():
        text = re.sub(pattern, sign, text)
    return text


def opening(text: str) -> str:
    """A text with a capital at its beginning; a leading symbol, such as k, stays as it is."""
    first = text.partition(" ")[0]
    return text if len(first) == 1 and first != "a" else f"{text[0].upper()}{text[1:]}"


def key_words(path: str) -> str:
    """Words for the key of a path in the scene file, such as "siphon crest radius"."""
    if path == FITTED:
        return "fitted inputs"
    key = path.rpartition(".")[2]
    return _KEYS.get(key, key.replace("_", " ").replace("hump", "siphon crest"))


def paths_named(text: str) -> str:
    """A sentence with the names of inputs in place of their paths in the scene file."""
    return _PATH.sub(lambda match: input_name(match[0]), text)


def resting(evidence: Mapping[str, Any], *paths: str) -> str:
    """The inputs among some that are neither given nor measured, with origin and value."""
    origins = evidence["scene"].get("origins") or {}
    values = {row.get("path"): row.get("value", "") for row in evidence["scene"].get("table") or ()}
    by_origin: dict[str, list[str]] = {}
    for input_path in paths:
        # A value derived from the mesh of an imported chamber rests on the mesh.
        of_mesh = origins.get(input_path) == "derived" and not input_path.startswith("gas.")
        path = _MESH if of_mesh else input_path
        if (origin := origins.get(path, "given")) not in _KNOWN_ORIGINS:
            text = f"{key_words(path)} {values.get(path, '')}".rstrip()
            by_origin.setdefault(origin, []).append(re.sub(r"\bum\b", "\N{MICRO SIGN}m", text))
    return "; ".join(f"{origin}: {', '.join(names)}" for origin, names in by_origin.items())


def named_with_origin(evidence: Mapping[str, Any], path: str) -> str:
    """An input's name, with its origin where it is neither given nor measured."""
    origin = (evidence["scene"].get("origins") or {}).get(path, "given")
    return input_name(path) + ("" if origin in _KNOWN_ORIGINS else f" ({origin})")


def input_name(path: str) -> str:
    """Name of the input at a path of the scene file, such as "bore of the tube"."""
    if path == FITTED:
        return "what was fitted together"
    table, _, key = path.partition(".")
    owner = _OWNERS.get(table, table.replace("_", " "))
    if not key or path.startswith(_ALONE) or owner in key_words(path).split():
        return key_words(path) if key else path
    return f"{key_words(path)} of the {owner}"


GLYPHS: Final = "<!-- glyphs -->"
_SYMBOL: Final = re.compile(r'<symbol id="([^"]+)"([^>]*/>|[^>]*>.*?</symbol>)', re.DOTALL)
_USE: Final = re.compile(r'href="#([^"]+)"')


@dataclass(frozen=True, kw_only=True)
class _Equation:
    """One displayed equation."""

    latex: str
    words: str
    """Text for screen readers."""
    source: str
    """Number in the paper, or description."""


@cache
def equations() -> Mapping[str, _Equation]:
    """The displayed equations of the report's sections, by name."""
    text = files("ringbalance.reports").joinpath("templates", "equations.toml").read_text(encoding="utf-8")
    return {name: _Equation(**entry) for name, entry in tomllib.loads(text).items()}


@cache
def _equation_svgs() -> Mapping[str, str]:
    """SVG of the program's own equations by their LaTeX, as `tools/doc_tables.py` has set them."""
    packed = files("ringbalance.reports").joinpath("data", "equations.json.xz").read_bytes()
    return cast(Mapping[str, str], json.loads(lzma.decompress(packed)))


@cache
def equation_svg(latex: str, words: str, name: str) -> str:
    """One equation as an SVG element in the current text colour, sized in the text's em.

    An equation of a case of the user's own, which is not among those of the program, is shown as its LaTeX.

    Args: `name`: prefix of every id within, so that two equations on one page do not share glyphs.
    """
    text = _equation_svgs().get(latex)
    if text is None:
        return f"<code>{escape(latex)}</code>"
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'href="#', f'href="#{name}-', text)

    def in_em(size: re.Match[str]) -> str:
        width, height = (float(pixels) / 16 for pixels in size.groups())
        return f' style="width:{width:.3f}em;height:{height:.3f}em"'

    text = re.sub(r' width="([\d.]+)" height="([\d.]+)"', in_em, text, count=1)
    label = words.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return text.replace("<svg ", f'<svg role="img" aria-label="{label}" class="math" ', 1)


def share_glyphs(page: str) -> str:
    """Leave one copy of each glyph for all equations of a page: equations are mostly the same letters."""
    names: dict[str, str] = {}
    shared = {match[1]: names.setdefault(match[2], f"glyph-{len(names)}") for match in _SYMBOL.finditer(page)}
    page = _USE.sub(lambda match: f'href="#{shared.get(match[1], match[1])}"', _SYMBOL.sub("", page))
    sheet = "".join(f'<symbol id="{name}"{content}' for content, name in names.items())
    hidden = 'width="0" height="0" style="position:absolute" aria-hidden="true"'
    return page.replace(GLYPHS, f'<svg xmlns="http://www.w3.org/2000/svg" {hidden}>{sheet}</svg>', 1)
