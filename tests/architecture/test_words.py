"""One vocabulary, that of docs/glossary.md: coined words do not come back, in texts, names or file names."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

SUFFIXES = {".py", ".md", ".toml", ".html", ".sh", ""}
# The history stays as it was written, and this file has to name what it rejects.  So do the bundled scenes:
# saved evidence knows them by their digest.
EXEMPT = {"CHANGELOG.md", "LICENSE", "tests/architecture/test_words.py"}
# Keys of JSON documents and the name of a scene file: scripts rely on them.
KEPT = re.compile(r"\"rungs?\"|`rungs?`|`quantities\[\]\.rungs`|driven_masses_small")
# What is rejected, and what to write instead.
REJECTED = {
    r"rungs?": "model, fidelity level",
    r"ladders?": "model hierarchy",
    r"dear|dearer": "expensive",
    r"hopeless": "ruled out",
    r"torn": "separated",
    r"by decree": "prescribed",
    r"crowds?": "ensemble",
    r"held against": "compared with",
    r"gone on with": "reused, resumed",
    r"anew": "again",
    r"told by": "reported by",
    r"drowns?": "is below the noise",
    r"to and fro": "back and forth",
    r"give or take": "plus or minus",
    r"reckon(?:s|ed|ing)?": "expect, calculate",
    r"lives? through": "passes",
    r"driven[ -]mass(?:es)?": "eccentric masses",
}
PATTERN = re.compile(r"\b(?:" + "|".join(REJECTED) + r")\b", re.IGNORECASE)
# Between words of a text: in identifiers the name of a key, such as `minimum_gas_time`, stays.
IN_TEXT = re.compile(r"\bgas times?\b", re.IGNORECASE)
# Where a line ends within a comment, or a string within a message, a phrase goes on.
SEAMS = re.compile(r"\s*\n\s*#\s|\"\s*\n\s*f?\"|\s+")


def coined(text: str) -> list[str]:
    """Rejected words and phrases of a text, in identifiers too; a part of a longer word does not count."""
    joined = SEAMS.sub(lambda seam: "" if seam[0].startswith('"') else " ", KEPT.sub("", text))
    spelled = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", joined).replace("_", " ")
    return [
        match[0]
        for pattern, where in ((PATTERN, spelled), (IN_TEXT, joined))
        for match in pattern.finditer(where)
    ]


def test_coined_words_stay_out(tracked_files: tuple[Path, ...], root: Path) -> None:
    found: dict[str, list[str]] = {}
    for path in tracked_files:
        name = path.relative_to(root).as_posix()
        if path.suffix in SUFFIXES and name not in EXEMPT and path.parent != root / "scenes":
            words = coined(name) + coined(path.read_text(encoding="utf-8"))
            found |= {name: words} if words else {}
    assert found == {}


@pytest.mark.parametrize(
    "text",
    [
        "the highest rung",
        "def loss_rungs(scene):",
        "class LadderChoice:",
        "k_ladder",
        "TORN = 1",
        "a dearer model",
        "k is fixed by\n    # decree",
        '"the limit "\n    "drowns in noise"',
        "what is\nheld against it",
        "begin_anew()",
        "as told by `closed`",
        "5 mm give or take 1 mm",
        "test_driven_masses.py",
        "the gas\ntimes of a chamber",
    ],
)
def test_coined_words_are_seen(text: str) -> None:
    assert len(coined(text)) == 1


@pytest.mark.parametrize(
    "text",
    [
        "a taut string, strung tight",
        "Runge and Kutta",
        "tornado, stubborn, torque",
        "to and from a file",
        "minimum_gas_time",
        "scenes/driven_masses_small.toml",
        '"rungs": []',
        "`rungs`",
        "an ensemble, a model hierarchy",
        "he told me",
    ],
)
def test_other_words_are_let_through(text: str) -> None:
    assert coined(text) == []
