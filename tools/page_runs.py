"""Run the code and the commands of pages in order, and write their output below them.

A block of `python` or `sh` is run in an empty folder with the bundled `scenes`. A block after a line that
ends in a file's name in code type and a colon becomes that file. A block of `text` directly after a block
that was run is its output; a line `...` in it stands for lines left out. A block after
`<!-- not run: REASON -->` is not run. A picture (SVG) of a page is written by its blocks under that name.

Each page, and each line that is one command of the program, is run in a copy of one process that has loaded
the program already; any other line is run by the shell.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

import ringbalance as rb
from ringbalance import cli
from ringbalance.running import TARGETS

ROOT: Final = Path(__file__).resolve().parents[1]
FENCE: Final = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
RUN: Final = frozenset({"python", "sh"})
GAP: Final = "..."
_FILE: Final = re.compile(r"`([\w./-]+)`:$")
_NOT_RUN: Final = re.compile(r"<!-- not run: .+ -->$")
_PICTURE: Final = re.compile(r"!\[[^\]]*\]\(([\w./-]+\.svg)\)")
_NUMBER: Final = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d{1,2}(?!\d))?")
_NAME: Final = re.compile(r"""id="[^"]*"|href="#[^"]*"|url\(#[^)]*\)""")
"""Identifiers and references in a picture, which are derived from its shapes."""
_COMMAND: Final = re.compile(r"ringbalance ([^|&;<>$`()]*?)( 2>&1)?(?: > ([\w./-]+))?")


class PageError(ValueError):
    """A page that does not run, or prints lines that it does not show."""


@dataclass
class Session:
    """Folder and Python names in which a page's blocks run one after the other."""

    folder: Path
    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "page"})

    def run(self, language: str, code: str) -> str:
        """Output of a block. Raises: PageError: a command that fails."""
        if language == "python":
            return self._python(code)
        return "".join(self._command(line) for line in code.replace("\\\n", " ").splitlines())

    def _python(self, code: str) -> str:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.chdir(self.folder):
            exec(compile(code, "<page>", "exec"), self.names)
        return printed.getvalue()

    def _command(self, line: str) -> str:
        command = _COMMAND.fullmatch(line.strip())
        ended, printed, said = self._program(*command.groups()) if command else self._shell(line)
        if ended:
            raise PageError(f"{line} ends with {ended}:\n{printed}{said}")
        return printed

    def _program(self, words: str, joined: str | None, target: str | None) -> tuple[int, str, str]:
        """Exit code, output and messages of a command of the program.

        Args: `joined`: set if messages go into the output. `target`: file that takes the output.
        """
        with contextlib.chdir(self.folder):
            ended, printed, said = forked(partial(cli.main, shlex.split(words)), joined=bool(joined))
            if target and not ended:
                Path(target).write_text(printed, encoding="utf-8")
        return ended, "" if target else printed, said

    def _shell(self, line: str) -> tuple[int, str, str]:
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
        done = subprocess.run(
            ["sh", "-c", line],
            capture_output=True,
            text=True,
            check=False,
            cwd=self.folder,
            env={**os.environ, "PATH": path},
        )
        return done.returncode, done.stdout, done.stderr


def forked(act: Callable[[], int], *, joined: bool = False) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a function called in a copy of this process."""
    with tempfile.TemporaryFile("w+") as printed, tempfile.TemporaryFile("w+") as said:
        sys.stdout.flush()
        sys.stderr.flush()
        child = os.fork()
        if not child:
            os.dup2(printed.fileno(), 1)
            os.dup2(printed.fileno() if joined else said.fileno(), 2)
            _ended_with(act)
        ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        for file in (printed, said):
            file.seek(0)
        return ended, printed.read(), said.read()


def _ended_with(act: Callable[[], int]) -> None:
    """End this process with the exit code of a function; 1 after an exception, which is printed."""
    code = 1
    try:
        code = act()
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def numbers_agree(first: str, second: str) -> bool:
    """True if two lines differ only in the last digits of numbers: processors sum in different orders."""
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
    lines, position, gap = [], 0, False
    for line in shown:
        if line == GAP:
            lines.append(line)
            gap = True
            continue
        last = len(printed) if gap else position + 1
        alike = [
            i for i in range(position, min(last, len(printed))) if _skeleton(printed[i]) == _skeleton(line)
        ]
        if not alike:
            raise PageError(
                f"shown but not printed: {line!r}, printed there: {printed[position : position + 3]}"
            )
        index = next((i for i in alike if numbers_agree(line, printed[i])), alike[0])
        lines.append(line if numbers_agree(line, printed[index]) else printed[index])
        position, gap = index + 1, False
    if position < len(printed) and not gap:
        raise PageError(f"printed but not shown: {printed[position:]}")
    return lines


def fresh_page(page: str, folder: Path) -> str:
    """A page with the present output of its blocks, run in a folder.

    Raises: PageError: as of `Session.run` and `shown_lines`; output below a block that is not run.
    """
    session = Session(folder)
    pieces: list[str] = []
    position, printed = 0, None
    for block in FENCE.finditer(page):
        language, body = block[1], block[2]
        between = page[position : block.start()]
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
        position = block.end()
    return "".join(pieces) + page[position:]


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
        pictures = [path.parent / position for position in _PICTURE.findall(page)]
        return {path: page} | {
            each: fresh_picture(each, written[each.name].read_text(encoding="utf-8"))
            for each in pictures
            if each.name in written
        }


def fresh_picture(path: Path, svg: str) -> str:
    """A picture as drawn now, or the kept one if only last digits differ."""
    current = path.read_text(encoding="utf-8") if path.exists() else ""
    first, second = (_NAME.sub("", each) for each in (current, svg))
    return current if _skeleton(first) == _skeleton(second) and numbers_agree(first, second) else svg


def pages() -> list[Path]:
    """Documents with a block that is run or marked as not run."""
    return sorted(
        path
        for path in (ROOT / "docs").rglob("*.md")
        if any(language in RUN for language, _ in FENCE.findall(path.read_text(encoding="utf-8")))
    )


def files(words: Sequence[str]) -> Iterator[tuple[Path, bytes]]:
    """Pages, all or those named, and their pictures, as they are printed and drawn now.

    Raises: PageError: of a page that does not run; the text has all of them.
    """
    _load()
    paths = [Path(word).resolve() for word in words] or pages()
    failed = []
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        for path, (ended, printed, said) in zip(paths, pool.map(_page_apart, paths), strict=True):
            if ended:
                failed.append(f"{path.name}: {said}")
                continue
            for name, text in json.loads(printed).items():
                yield Path(name), text.encode()
    if failed:
        raise PageError("\n".join(failed))


def _load() -> None:
    """Load the program, compiled code included, into this process for all processes forked from it."""
    # Read by every console of the program.
    os.environ["COLUMNS"] = "100"
    # Pages run in parallel, so that none starts processes of its own.
    os.cpu_count = lambda: 1
    for target in TARGETS.values():
        import_module(target.partition(":")[0])
    rb.simulate(rb.load_scene(rb.bundled_scene("liquid_ring_paper")))


def _page_apart(path: Path) -> tuple[int, str, str]:
    return forked(partial(_print_page, path))


def _print_page(path: Path) -> int:
    print(json.dumps({str(name): text for name, text in fresh(path).items()}))
    return 0
