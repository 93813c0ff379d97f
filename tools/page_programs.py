"""Pages are programs: their code and commands run in order, and what they print stands below them.

python tools/page_programs.py PAGE ...            exit code 1 where a page prints something else than it shows
python tools/page_programs.py --write PAGE ...    writes what it prints

A block of `python` or `sh` is run in an empty folder with the bundled `scenes`. A block after a line that
ends in a file's name in code type and a colon becomes that file. A block of `text` straight after a block
that was run is what that one printed; in it a line `...` stands for lines left out. A block after
`<!-- not run: REASON -->` is not run. A picture (SVG) that a page shows is the one that its blocks write
under that name.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from ringbalance.scene import write_whole

ROOT: Final = Path(__file__).resolve().parents[1]
FENCE: Final = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
RUN: Final = frozenset({"python", "sh"})
GAP: Final = "..."
_FILE: Final = re.compile(r"`([\w./-]+)`:$")
_NOT_RUN: Final = re.compile(r"<!-- not run: .+ -->$")
_PICTURE: Final = re.compile(r"!\[[^\]]*\]\(([\w./-]+\.svg)\)")
_NUMBER: Final = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d{1,2}(?!\d))?")
_NAME: Final = re.compile(r"""id="[^"]*"|href="#[^"]*"|url\(#[^)]*\)""")
"""Within a picture: made from the shapes that it names."""


class PageError(ValueError):
    """A page that does not run, or prints lines that it does not show."""


@dataclass
class Session:
    """A folder, and the names of Python, in which a page's blocks run one after the other."""

    folder: Path
    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "page"})

    def run(self, language: str, code: str) -> str:
        """What a block prints. Raises: PageError: a command that fails."""
        return self._python(code) if language == "python" else self._commands(code)

    def _python(self, code: str) -> str:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.chdir(self.folder):
            exec(compile(code, "<page>", "exec"), self.names)
        return printed.getvalue()

    def _commands(self, code: str) -> str:
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
        done = subprocess.run(
            ["sh", "-c", code],
            capture_output=True,
            text=True,
            check=False,
            cwd=self.folder,
            env={**os.environ, "PATH": path, "COLUMNS": "100"},
        )
        if done.returncode:
            raise PageError(f"{code}ends with {done.returncode}:\n{done.stdout}{done.stderr}")
        return done.stdout


def numbers_agree(first: str, second: str) -> bool:
    """Whether two lines differ in the last digits of numbers alone: other processors sum in other orders."""
    pairs = zip(_NUMBER.findall(first), _NUMBER.findall(second), strict=True)
    return all(abs(float(a) - float(b)) <= max(_last_digit(a), 1e-3 * abs(float(a))) for a, b in pairs)


def _last_digit(number: str) -> float:
    mantissa, _, exponent = number.partition("e")
    return 1.001 * float(10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2])))


def _skeleton(line: str) -> str:
    return " ".join(_NUMBER.sub("#", line).split())


def shown_lines(shown: Sequence[str], printed: Sequence[str]) -> list[str]:
    """Lines that a page shows, with the numbers that are printed now where those differ.

    Raises: PageError: a line that is not printed, or lines printed that are not shown.
    """
    if not shown:
        return list(printed)
    lines, place, gap = [], 0, False
    for line in shown:
        if line == GAP:
            lines.append(line)
            gap = True
            continue
        last = len(printed) if gap else place + 1
        alike = [i for i in range(place, min(last, len(printed))) if _skeleton(printed[i]) == _skeleton(line)]
        if not alike:
            raise PageError(f"shown but not printed: {line!r}, printed there: {printed[place : place + 3]}")
        index = next((i for i in alike if numbers_agree(line, printed[i])), alike[0])
        lines.append(line if numbers_agree(line, printed[index]) else printed[index])
        place, gap = index + 1, False
    if place < len(printed) and not gap:
        raise PageError(f"printed but not shown: {printed[place:]}")
    return lines


def fresh_page(page: str, folder: Path) -> str:
    """A page with what its blocks print now, run in a folder.

    Raises: PageError: as of `Session.run` and `shown_lines`; output below a block that is not run.
    """
    session = Session(folder)
    pieces: list[str] = []
    place, printed = 0, None
    for block in FENCE.finditer(page):
        language, body = block[1], block[2]
        between = page[place : block.start()]
        pieces.append(between)
        before = between.rstrip().rpartition("\n")[2]
        name = _FILE.search(before) if language != "sh" else None
        if language == "text" and printed is not None and not between.strip():
            shown = shown_lines(body.splitlines(), [line.rstrip() for line in printed.splitlines()])
            body, printed = "".join(f"{line}\n" for line in shown), None
        elif name:
            target = folder / name[1]
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(body, encoding="utf-8")
            printed = None
        elif language in RUN and not _NOT_RUN.search(before):
            printed = session.run(language, body)
        else:
            printed = None
        pieces.append(f"```{language}\n{body}```")
        place = block.end()
    return "".join(pieces) + page[place:]


def fresh(path: Path) -> dict[Path, str]:
    """A page run in a folder of its own, and the pictures that its blocks wrote.

    Raises: PageError: as of `fresh_page`.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for linked in ("scenes", "benchmarks"):
            (folder / linked).symlink_to(ROOT / linked, target_is_directory=True)
        page = fresh_page(path.read_text(encoding="utf-8"), folder)
        written = {each.name: each for each in folder.rglob("*.svg")}
        pictures = [path.parent / place for place in _PICTURE.findall(page)]
        return {path: page} | {
            each: fresh_picture(each, written[each.name].read_text(encoding="utf-8"))
            for each in pictures
            if each.name in written
        }


def fresh_picture(path: Path, drawn: str) -> str:
    """A picture as it was drawn, or as it is kept where no more than last digits differ."""
    kept = path.read_text(encoding="utf-8") if path.exists() else ""
    first, second = (_NAME.sub("", each) for each in (kept, drawn))
    return kept if _skeleton(first) == _skeleton(second) and numbers_agree(first, second) else drawn


def main(arguments: list[str]) -> int:
    """Run pages, and write or name what changed."""
    stale = 0
    for name in (each for each in arguments if each != "--write"):
        for path, text in fresh(Path(name)).items():
            if path.exists() and path.read_text(encoding="utf-8") == text:
                continue
            print(f"{name} prints or draws something else than {path.name} shows")
            stale += 1
            if "--write" in arguments:
                path.parent.mkdir(exist_ok=True)
                write_whole(path, text.encode())
    return int(bool(stale) and "--write" not in arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
