"""Errors of a scene file, one sentence each, reported together."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass, replace

from ringbalance.scene.toml import toml_text

MISSING = "missing"
COMMAND_LINE = "command line"
"""File of the errors of options."""
MOST_SHOWN_FAULTS = 50
"""Errors that the message of a `SceneError` lists; more are counted."""
_WORD_CHARACTERS = 60


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One error of a scene file, with all that is needed to correct it."""

    file: str
    """The scene file, as it was named."""
    table: str = ""
    """Table in the file, such as "disc"; empty for the top level and for the file itself."""
    key: str = ""
    """Key in the table; empty when the whole table or file is in error."""
    value: str = ""
    """Present value as TOML writes it; "missing" without one; empty where it does not apply."""
    problem: str
    """Description of the error."""
    allowed: str = ""
    """Accepted values; empty when the problem says it all."""

    def __str__(self) -> str:
        """The error on one line: file: [table] key = value: what is wrong; allowed: ..."""
        path = " ".join(part for part in (f"[{self.table}]" if self.table else "", self.key) if part)
        if path:
            path += (
                f" is {MISSING}: " if self.value == MISSING else f" = {self.value}: " if self.value else ": "
            )
        end = f"; allowed: {self.allowed}" if self.allowed else ""
        return f"{self.file}: {path}{self.problem}{end}"


class SceneError(Exception):
    """A scene that cannot be used; `faults` has all its errors.

    Args: `faults`: one or more errors; the lines of the first fifty, and the number of the others, are the
        message.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> try:
        ...     scene.with_values({"tube.bore": "80 mm"})
        ... except rb.SceneError as error:
        ...     [(fault.table, fault.key) for fault in error.faults]
        [('tube', 'bore'), ('tube', 'bore')]
    """

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults: tuple[Fault, ...] = tuple(faults)
        lines = [str(fault) for fault in self.faults[:MOST_SHOWN_FAULTS]]
        more = len(self.faults) - len(lines)
        if more:
            lines.append(f"{self.faults[0].file}: and {more} more; correct these first")
        super().__init__("\n".join(lines))

    def __reduce__(self) -> tuple[type[SceneError], tuple[tuple[Fault, ...]]]:
        """Rebuild from the list of errors, so that the error survives the way back from a worker process."""
        return type(self), (self.faults,)

    @classmethod
    def of_file(cls, file: str, problem: str, allowed: str = "") -> SceneError:
        """The error of a file that cannot be used at all."""
        return cls([Fault(file=file, problem=problem, allowed=allowed)])

    @classmethod
    def of_option(cls, *, option: str, value: object, problem: str, allowed: str) -> SceneError:
        """The error of a command-line option that cannot be used."""
        value = toml_text(value)
        return cls([Fault(file=COMMAND_LINE, key=option, value=value, problem=problem, allowed=allowed)])

    def as_keys_of(self, file: str) -> SceneError:
        """The errors, those of options as of keys of a file or arguments of a function of the same names."""
        return SceneError(
            replace(each, file=file, key=each.key.removeprefix("--")) if each.file == COMMAND_LINE else each
            for each in self.faults
        )


def closest(word: str, words: Iterable[str]) -> str:
    """The known word that was probably meant; an empty string when nothing is close."""
    folded = {name.casefold(): name for name in words}
    close = difflib.get_close_matches(word.casefold()[:_WORD_CHARACTERS], list(folded), n=1, cutoff=0.6)
    return folded[close[0]] if close else ""


def plain_name(name: str) -> str:
    """A name by its letters and digits alone: case, spaces and dashes do not matter."""
    return "".join(character for character in name.casefold() if character.isalnum())


def did_you_mean(word: str, words: Iterable[str]) -> str:
    """' (did you mean "x"?)' with the known word that is closest; empty when none is close."""
    return meant_text(closest(word, words))


def meant_text(name: str) -> str:
    """' (did you mean "x"?)' for a word that is meant; empty for none."""
    return f' (did you mean "{name}"?)' if name else ""
