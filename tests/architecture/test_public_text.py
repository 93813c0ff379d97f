"""The repository is of use to a stranger: no machine's paths, no download hosts, no large binaries."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

LARGEST_BINARY = 200_000
# Put together from halves, so that this file passes its own test.
HOSTS = ("pypi" + ".org", "pythonhosted" + ".org", "npmjs" + ".org", "debian" + ".org", "anaconda" + ".org")
MACHINE_PATH = re.compile(r"(?<![\w/.~$})])/(?:wo" + "rk|ro" + "ot|ho" + r"me)\b")
OUTSIDE = re.compile(r"\.\./" + "shared")


def text_faults(text: str) -> list[str]:
    """Host names of package registries, paths of one machine, and files outside the repository."""
    found = [f"host {host}" for host in HOSTS if host in text]
    found += [f"machine path {match[0]}" for match in MACHINE_PATH.finditer(text)]
    found += [f"outside the repository: {match[0]}" for match in OUTSIDE.finditer(text)]
    return found


def is_binary(content: bytes) -> bool:
    """True when the bytes are not text."""
    try:
        content.decode()
    except UnicodeDecodeError:
        return True
    return b"\0" in content


def test_text_names_nothing_of_one_machine(tracked_files: tuple[Path, ...]) -> None:
    contents = {path: path.read_bytes() for path in tracked_files}
    texts = {path: content.decode() for path, content in contents.items() if not is_binary(content)}
    assert len(texts) > 20
    assert {str(path): text_faults(text) for path, text in texts.items() if text_faults(text)} == {}


def test_no_large_binary(tracked_files: tuple[Path, ...]) -> None:
    large = [path for path in tracked_files if path.stat().st_size > LARGEST_BINARY]
    assert [str(path) for path in large if is_binary(path.read_bytes())] == []


def test_no_generated_file(tracked_files: tuple[Path, ...]) -> None:
    generated = {".html", ".vtu", ".png", ".pdf", ".pyc", ".whl"}
    assert [
        str(path) for path in tracked_files if path.suffix in generated and "templates" not in path.parts
    ] == []


@pytest.mark.parametrize(
    "text",
    [
        "see /wo" + "rk/notes",
        "(/ro" + "ot/.cache)",
        "/ho" + "me/ann/disc.toml",
        "data from ../" + "shared/x.csv",
        "index-url = https://pypi" + ".org/simple",
        "https://files.pythonhosted" + ".org/packages",
    ],
)
def test_faults_are_seen(text: str) -> None:
    assert len(text_faults(text)) == 1


@pytest.mark.parametrize(
    "text", ["force/work done", "the square/root", "$(HOME)/home", "a shared edge", "https://doi.org/10.3390"]
)
def test_ordinary_text_is_let_through(text: str) -> None:
    assert text_faults(text) == []


@pytest.mark.parametrize(
    ("content", "binary"), [(b"plain", False), ("Ωµ".encode(), False), (b"\x89PNG", True), (b"a\0b", True)]
)
def test_binaries_are_distinguished_from_text(content: bytes, binary: bool) -> None:
    assert is_binary(content) == binary
