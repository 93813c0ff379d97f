"""Readable equivalents for characters that an encoding lacks: lambda for λ, +/- for ±, um for µm.

The error handler of standard output and standard error: nothing that prints has to know encodings.
"""

from __future__ import annotations

import unicodedata
from typing import Final

ERRORS: Final = "ringbalance.plain_text"
"""Name under which `replace` is registered with `codecs`."""

_EQUIVALENTS: Final = {
    **dict(zip("▁▂▃▄▅▆▇█", "12345678", strict=True)),
    **dict.fromkeys("‘’‚‛′ʼ´", "'"),
    **dict.fromkeys("“”„‟″«»", '"'),
    **dict.fromkeys("−‐–—―─━╌", "-"),
    **dict.fromkeys("│┃╎", "|"),
    **dict.fromkeys("·⋅∙×", "*"),
    **dict.fromkeys("•●▪✓", "*"),
    "±": "+/-",
    "≤": "<=",
    "≥": ">=",
    "≠": "!=",
    "≈": "~",
    "∝": "~",
    "√": "sqrt",
    "∞": "inf",
    "∂": "d",
    "→": "->",
    "←": "<-",
    "⇒": "=>",
    "°": "deg",
    "µ": "u",
    "μ": "u",
    "\u2126": "ohm",
    "∫": "int",
    "∇": "grad",
    "ß": "ss",
    "ø": "o",
    "Ø": "O",
    "æ": "ae",
    "Æ": "AE",
    "œ": "oe",
    "Œ": "OE",
    "đ": "d",
    "ł": "l",
    "Ł": "L",
    "\u2044": "/",
    "\u2215": "/",
    "\u200b": "",
    "\ufeff": "",
    "©": "(c)",
    "®": "(R)",
    "€": "EUR",
    "£": "GBP",
}
_UNKNOWN: Final = "?"
_FIRST_RAW, _LAST_RAW = 0xDC80, 0xDCFF
_RAW_OFFSET: Final = 0xDC00


def replace(error: UnicodeError) -> tuple[str | bytes, int]:
    """Replace the first character that could not be encoded; an error handler for `codecs.register_error`.

    Args: `error`: as raised by an encoder.
    Returns: ASCII text, or the original byte of a file name that is not UTF-8, and where encoding resumes.
    Raises: UnicodeError: anything but an encoding error.
    """
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text, at = error.object, error.start
    code = ord(text[at])
    if _FIRST_RAW <= code <= _LAST_RAW:
        return bytes([code - _RAW_OFFSET]), at + 1
    return _in_context(text, at), at + 1


def _equivalent(character: str) -> str:
    """ASCII equivalent of one character.

    Args: `character`: any one character.
    Returns: ASCII text, empty for marks without width; "?" when there is no equivalent.
    """
    if character.isascii():
        return character
    if character in _EQUIVALENTS:
        return _EQUIVALENTS[character]
    if unicodedata.combining(character):
        return ""
    decomposed = unicodedata.normalize("NFKD", character)
    if decomposed != character:
        return "".join(map(_equivalent, decomposed))
    return _greek(character) or _UNKNOWN


def _greek(character: str) -> str:
    words = unicodedata.name(character, "").split()
    if words[:1] != ["GREEK"] or "LETTER" not in words:
        return ""
    name = words[-1].replace("LAMDA", "LAMBDA").lower()
    return name.capitalize() if "CAPITAL" in words else name


def _in_context(text: str, at: int) -> str:
    """The equivalent, with ^ or _ before a raised or lowered part and spaces around the name of a letter."""
    before, character, after = text[at - 1 : at] if at else "", text[at], text[at + 1 : at + 2]
    found = _equivalent(character)
    mark = _mark(character)
    if mark:
        return found if _mark(before) == mark else mark + found
    if not _greek(character) or found == _EQUIVALENTS.get(character):
        return found
    lead = " " if before.isascii() and before.isalpha() else ""
    return lead + found + (" " if after.isalnum() and not _mark(after) else "")


def _mark(character: str) -> str:
    kind = unicodedata.decomposition(character).split(" ", 1)[0] if character else ""
    return {"<super>": "^", "<sub>": "_"}.get(kind, "")
