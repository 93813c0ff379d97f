"""Lists functions whose body is longer than a reader likes, and refuses those that are far too long.

    python tools/long_functions.py PATH...

A body is counted without its docstring.  Over 35 lines is a question, printed; over 80 lines, and a file of
more than 485 lines, is refused with exit code 1.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

QUESTION = 35
REFUSE = 80
LONGEST_FILE = 485


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function's body without its docstring."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def python_files(paths: list[Path]) -> Iterator[Path]:
    """The paths themselves, and the Python files below those that are folders."""
    for path in paths:
        yield from sorted(path.rglob("*.py")) if path.is_dir() else [path]


def findings(path: Path) -> Iterator[tuple[bool, str]]:
    """Whether it is refused, and what was found, for each thing found in a file."""
    source = path.read_text()
    lines = source.count("\n")
    if lines > LONGEST_FILE:
        yield True, f"{path}: {lines} lines; at most {LONGEST_FILE}"
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and body_lines(node) > QUESTION:
            refused = body_lines(node) > REFUSE
            yield refused, f"{path}:{node.lineno}: {node.name} has {body_lines(node)} lines; could it be two?"


def main() -> int:
    """Print what was found; 1 when something is refused."""
    found = [each for path in python_files([Path(word) for word in sys.argv[1:]]) for each in findings(path)]
    for _, text in found:
        print(text)
    return int(any(refused for refused, _ in found))


if __name__ == "__main__":
    sys.exit(main())
