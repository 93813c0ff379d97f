"""Treatment of a page by `make pages`; no number in the text of a tutorial is typed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Final

import page_runs
import pytest

import ringbalance as rb

DOCS: Final = Path(__file__).resolve().parents[1] / "docs"
TUTORIALS: Final = sorted((DOCS / "tutorials").glob("*.md"))
NAMES: Final = re.compile(
    r"`[^`]*`|\]\([^)]*\)|\b(?:ISO|IEC) \d+(?:-\d+)?|\bEq\. \d+|^#.*$|\b95 %", re.MULTILINE
)
NUMBER: Final = re.compile(r"\d+(?:\.\d+)?")


def typed_numbers(page: str) -> set[str]:
    """Numbers in the text of a page that none of its blocks has."""
    blocks = " ".join(body for _, body in page_runs.FENCE.findall(page))
    text = NAMES.sub("", page_runs.FENCE.sub("", page))
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
    assert page_runs.fresh_page(PAGE.format(shown=shown), tmp_path) == PAGE.format(shown=fresh)


@pytest.mark.parametrize("shown", ["y\n 2.5\n", "x\n", "x\n 2.5\nz\n", " 2.5\n"])
def test_lines_that_are_not_printed_are_refused(shown: str, tmp_path: Path) -> None:
    with pytest.raises(page_runs.PageError):
        page_runs.fresh_page(PAGE.format(shown=shown), tmp_path)


def test_a_command_that_fails_is_refused(tmp_path: Path) -> None:
    with pytest.raises(page_runs.PageError, match="ends with 3"):
        page_runs.fresh_page("```sh\nexit 3\n```\n", tmp_path)


def test_a_block_is_left_out_with_a_reason_alone(tmp_path: Path) -> None:
    block = "```python\nraise KeyError\n```\n"
    page = f"<!-- not run: needs a cluster -->\n{block}"
    assert page_runs.fresh_page(page, tmp_path) == page
    with pytest.raises(KeyError):
        page_runs.fresh_page(f"<!-- not run: -->\n{block}", tmp_path)


def generate(*words: str | Path) -> subprocess.CompletedProcess[str]:
    """In a process without pytest's threads: a page is run in a copy of it."""
    return subprocess.run(
        [sys.executable, "-W", "error", DOCS.parent / "tools" / "generate.py", *words],
        capture_output=True,
        text=True,
        check=False,
    )


def test_commands_of_a_page_are_run_and_written(tmp_path: Path) -> None:
    """A page that fails does not keep others from being written."""
    good, bad = tmp_path / "good.md", tmp_path / "bad.md"
    scene = "scenes/six_chamber.toml"
    lines = (
        "ringbalance --version\n"
        f"ringbalance calibrate {scene} --brief > brief.txt\n"
        "grep -c Calibration brief.txt"
    )
    good.write_text(f"```sh\n{lines}\n```\n\n```text\n```\n")
    bad.write_text("```sh\nringbalance calibrate \\\n  absent.toml\n```\n")
    done = generate("--write", "pages", good, bad)
    assert done.returncode == 1
    assert "bad.md: Traceback" in done.stderr
    assert re.search(r"PageError: ringbalance calibrate +absent\.toml ends with 2", done.stderr)
    assert good.read_text() == f"```sh\n{lines}\n```\n\n```text\n{rb.__version__}\n1\n```\n"
    assert generate("pages", good).returncode == 0
    good.write_text(good.read_text().replace("\n1\n", "\n7\n"))
    done = generate("pages", good)
    assert (done.returncode, done.stdout) == (1, f"{good}: not what is generated now\n")
