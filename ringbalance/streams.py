"""Standard streams of the process: in any encoding, closed, full, or with a reader that goes away.

Characters that an encoding lacks get readable equivalents, lambda for λ, +/- for ±, um for µm: nothing that
prints has to know encodings.
"""

from __future__ import annotations

import codecs
import io
import os
import re
import sys
import unicodedata
from collections.abc import MutableMapping
from typing import TYPE_CHECKING, BinaryIO, Final, TextIO, cast

ERRORS: Final = "ringbalance.streams"
"""Name under which `in_ascii` is registered with `codecs`."""

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


def in_ascii(error: UnicodeError) -> tuple[str | bytes, int]:
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
    ascii_text = _equivalent(character)
    mark = _mark(character)
    if mark:
        return ascii_text if _mark(before) == mark else mark + ascii_text
    if not _greek(character) or ascii_text == _EQUIVALENTS.get(character):
        return ascii_text
    lead = " " if before.isascii() and before.isalpha() else ""
    return lead + ascii_text + (" " if after.isalnum() and not _mark(after) else "")


def _mark(character: str) -> str:
    kind = unicodedata.decomposition(character).split(" ", 1)[0] if character else ""
    return {"<super>": "^", "<sub>": "_"}.get(kind, "")


if TYPE_CHECKING:
    from typing_extensions import Buffer

_LAST_STANDARD: Final = 2
_WITHOUT_DOCSTRINGS: Final = 2
_MIN_COLUMNS: Final = 20
MAX_COLUMNS: Final = 10_000


class _NamedFile(io.FileIO):
    """A standard stream whose errors name it, as those of any other file do."""

    def __init__(self, descriptor: int, title: str) -> None:
        super().__init__(descriptor, "w", closefd=False)
        self.title = title

    def write(self, data: Buffer) -> int:
        """Write bytes.

        Returns: Number of bytes written.
        Raises: OSError: the stream cannot be written; its `filename` is the stream's title.
        """
        try:
            return super().write(data)
        except OSError as error:
            error.filename = self.title
            raise


def prepare_streams() -> str:
    """Make standard output and error safe to write to, even if the shell closed them.

    Returns: Reason why results cannot be written; empty: they can.
    """
    closed = sys.stdout is None
    # The null device takes the place of a closed standard stream: no file opened later takes its number.
    descriptor = os.open(os.devnull, os.O_RDWR)
    while descriptor <= _LAST_STANDARD:
        os.set_inheritable(descriptor, True)
        descriptor = os.open(os.devnull, os.O_RDWR)
    os.close(descriptor)
    codecs.register_error(ERRORS, in_ascii)
    sys.stdout = _tolerant(sys.stdout, "standard output")
    sys.stderr = _tolerant(sys.stderr, "standard error")
    return "standard output is closed; nothing was computed" if closed else ""


def interpreter_error() -> str:
    """Reason why this interpreter cannot run the commands; empty: it can."""
    if sys.flags.optimize < _WITHOUT_DOCSTRINGS:
        return ""
    return "needs docstrings, which PYTHONOPTIMIZE=2 (python -OO) removes: unset it or set it to 1"


def drop_unusable_size(environment: MutableMapping[str, str]) -> None:
    """Remove a terminal size that no table fits into: the actual size is then used.

    Args: `environment`: variables of the process; COLUMNS below 20, LINES below 1 and values that are no
        numbers are removed.
    """
    for name, least in (("COLUMNS", _MIN_COLUMNS), ("LINES", 1)):
        value = environment.get(name, "")
        if not (re.fullmatch("[0-9]{1,6}", value) and least <= int(value) <= MAX_COLUMNS):
            environment.pop(name, None)


def discard_unwritten() -> None:
    """Discard unwritten output of a stream: the interpreter would flush it again at its end and fail."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            null_device = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null_device, stream.fileno())
            os.close(null_device)


def _tolerant(stream: TextIO | None, title: str) -> TextIO:
    """The stream in any encoding, its errors naming it; the null device in place of a closed one."""
    if stream is None:
        return open(os.devnull, "w", encoding="utf-8")
    if isinstance(stream, io.TextIOWrapper):
        stream.reconfigure(errors=ERRORS)
        # With PYTHONUNBUFFERED there is no buffer in between.
        if type(getattr(stream.buffer, "raw", stream.buffer)) is io.FileIO:
            named = _NamedFile(stream.fileno(), title)
            return io.TextIOWrapper(
                cast(BinaryIO, named if isinstance(stream.buffer, io.FileIO) else io.BufferedWriter(named)),
                encoding=stream.encoding,
                errors=stream.errors,
                line_buffering=stream.line_buffering,
                write_through=stream.write_through,
            )
    return stream
