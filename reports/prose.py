"""Plain-text prose into proper signs: Greek letters, powers, subscripts; no number is changed."""

from __future__ import annotations

import re
from typing import Final

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
    return path.rpartition(".")[2].replace("_", " ").replace("hump", "siphon crest")


def _index(match: re.Match[str]) -> str:
    return (match[1] or match[2]) + match[3].translate(_SUBSCRIPTS) + ("′" if match[4] else "")
