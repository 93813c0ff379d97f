"""No comment holds the rest of a statement that a re-wrapped line has swallowed."""

from __future__ import annotations

import io
import re
import tokenize
from pathlib import Path

import pytest

SWALLOWED = re.compile(r"(?<!e\.g)(?<!i\.e)\. [a-z_].*(?:\w\(|==|[\])] [<>]=? )")
"""After the end of a sentence no capital, and then a call or a comparison."""


def comments(text: str) -> list[str]:
    """Comments of a module, successive lines joined."""
    blocks: list[str] = []
    last = -2
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type != tokenize.COMMENT:
            continue
        words = token.string.lstrip("# ")
        if token.start[0] == last + 1 and token.line.lstrip().startswith("#"):
            blocks[-1] += f" {words}"
        else:
            blocks.append(words)
        last = token.start[0]
    return [block for block in blocks if not block.startswith(("noqa", "type:"))]


def test_no_comment_holds_code(tracked_files: tuple[Path, ...]) -> None:
    modules = {path: path.read_text() for path in tracked_files if path.suffix == ".py"}
    assert len(modules) > 400
    swallowed = {str(p): [c for c in comments(text) if SWALLOWED.search(c)] for p, text in modules.items()}
    assert {path: texts for path, texts in swallowed.items() if texts} == {}


@pytest.mark.parametrize(
    "text",
    [
        "# Has some room in three\n# dimensions. sert rates(found)[-1] == pytest.approx(order, abs=0.15)\n",
        "x = 1  # by hand. np.testing.assert_allclose(a, b)\n",
        "# As the paper has it. ound = solve(1)\n",
        "# Never larger. sert error[0] < bound\n",
    ],
)
def test_swallowed_code_is_detected(text: str) -> None:
    assert SWALLOWED.search(comments(text)[0])
