"""Pages run as they stand and print what they show; no number in the text of a tutorial is typed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Final

import page_programs
import pytest

DOCS: Final = Path(__file__).resolve().parents[1] / "docs"
PAGES: Final = sorted(
    path
    for path in DOCS.rglob("*.md")
    if any(language in page_programs.RUN for language, _ in page_programs.FENCE.findall(path.read_text()))
)
TUTORIALS: Final = sorted((DOCS / "tutorials").glob("*.md"))
NAMES: Final = re.compile(
    r"`[^`]*`|\]\([^)]*\)|\b(?:ISO|IEC) \d+(?:-\d+)?|\bEq\. \d+|^#.*$|\b95 %", re.MULTILINE
)
NUMBER: Final = re.compile(r"\d+(?:\.\d+)?")


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.stem))
def test_a_page_prints_what_it_shows(page: Path) -> None:
    """In a process of its own, as a reader's, with every warning an error."""
    done = subprocess.run(
        [sys.executable, "-W", "error", page_programs.__file__, str(page)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def typed_numbers(page: str) -> set[str]:
    """Numbers in the text of a page that none of its blocks has."""
    blocks = " ".join(body for _, body in page_programs.FENCE.findall(page))
    text = NAMES.sub("", page_programs.FENCE.sub("", page))
    return set(NUMBER.findall(text)) - set(NUMBER.findall(blocks))


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda path: str(path.stem))
def test_no_number_of_a_tutorial_is_typed(page: Path) -> None:
    assert typed_numbers(page.read_text(encoding="utf-8")) == set()


def test_a_typed_number_is_seen() -> None:
    page = "# Page 7\n\nTakes 3.2 m/s of 4 (95 %, ISO 21940-11, `x = 5`).\n\n```text\n4 m/s\n```\n"
    assert typed_numbers(page) == {"3.2"}


PAGE: Final = """`a.txt`:

```text
x
```

```python
from pathlib import Path
print(Path("a.txt").read_text(), 2.50)
```

```text
{shown}```
"""


@pytest.mark.parametrize(
    ("shown", "fresh"),
    [
        ("", "x\n 2.5\n"),
        ("x\n 2.5\n", "x\n 2.5\n"),
        ("x\n 2.6\n", "x\n 2.6\n"),
        ("x\n 2.8\n", "x\n 2.5\n"),
        ("...\n 2.5\n", "...\n 2.5\n"),
        ("x\n...\n", "x\n...\n"),
    ],
)
def test_what_is_printed_stands_below(shown: str, fresh: str, tmp_path: Path) -> None:
    assert page_programs.fresh_page(PAGE.format(shown=shown), tmp_path) == PAGE.format(shown=fresh)


@pytest.mark.parametrize("shown", ["y\n 2.5\n", "x\n", "x\n 2.5\nz\n", " 2.5\n"])
def test_lines_that_are_not_printed_are_refused(shown: str, tmp_path: Path) -> None:
    with pytest.raises(page_programs.PageError):
        page_programs.fresh_page(PAGE.format(shown=shown), tmp_path)


def test_a_command_that_fails_is_refused(tmp_path: Path) -> None:
    with pytest.raises(page_programs.PageError, match="ends with 3"):
        page_programs.fresh_page("```sh\nexit 3\n```\n", tmp_path)


def test_a_block_is_left_out_with_a_reason_alone(tmp_path: Path) -> None:
    block = "```python\nraise KeyError\n```\n"
    page = f"<!-- not run: needs a cluster -->\n{block}"
    assert page_programs.fresh_page(page, tmp_path) == page
    with pytest.raises(KeyError):
        page_programs.fresh_page(f"<!-- not run: -->\n{block}", tmp_path)
