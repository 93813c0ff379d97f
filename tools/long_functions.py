"""List long functions, and refuse those that are far too long.

    python tools/long_functions.py PATH...

A body is counted without its docstring.  Over 60 lines a function is listed; over 80 lines it is refused with
exit code 1.  A file may have any length.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

QUESTION = 60
REFUSE = 80


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function's body without its docstring."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def python_files(paths: list[Path]) -> Iterator[Path]:
    """The paths themselves, and the Python files below those that are folders."""
    for path in paths:
        yield from sorted(path.rglob("*.py")) if path.is_dir() else [path]


def long_functions(path: Path) -> Iterator[tuple[str, int, int]]:
    """Name, first line and lines of the body of each function of a file with more lines than `QUESTION`."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and body_lines(node) > QUESTION:
            yield node.name, node.lineno, body_lines(node)


def main() -> int:
    """Print the long functions; 1 when one is refused."""
    refused = False
    for path in python_files([Path(word) for word in sys.argv[1:]]):
        for name, first, lines in long_functions(path):
            print(f"{path}:{first}: {name} has {lines} lines; could it be two?")
            refused |= lines > REFUSE
    return int(refused)


if __name__ == "__main__":
    sys.exit(main())
