"""Texts serve a stranger: no coined words, machine paths, hosts, large binaries, code inside a comment."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

SUFFIXES = {".py", ".md", ".toml", ".html", ".sh", ""}
# The history stays as it was written, and this file has to name what it rejects.  So do the bundled scenes:
# saved evidence knows them by their digest.
EXEMPT = {"CHANGELOG.md", "LICENSE", "tests/architecture/test_texts.py"}
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
SWALLOWED = re.compile(r"(?<!e\.g)(?<!i\.e)\. [a-z_].*(?:\w\(|==|[\])] [<>]=? )")
"""After the end of a sentence no capital, and then a call or a comparison."""
COMMENT = re.compile(r"^ *#.*(?:\n *#.*)*|(?<=  )# .*$", re.MULTILINE)
LARGEST_BINARY_BYTES = 200_000
# Put together from halves, so that this file passes its own test.
HOSTS = ("pypi" + ".org", "pythonhosted" + ".org", "npmjs" + ".org", "debian" + ".org", "anaconda" + ".org")
MACHINE_PATH = re.compile(r"(?<![\w/.~$})])/(?:wo" + "rk|ro" + "ot|ho" + r"me)\b")
OUTSIDE = re.compile(r"\.\./" + "shared")


def coined(text: str) -> list[str]:
    """Rejected words and phrases of a text, in identifiers too; a part of a longer word does not count."""
    joined = SEAMS.sub(lambda seam: "" if seam[0].startswith('"') else " ", KEPT.sub("", text))
    spelled = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", joined).replace("_", " ")
    return [
        match[0]
        for pattern, where in ((PATTERN, spelled), (IN_TEXT, joined))
        for match in pattern.finditer(where)
    ]


def comments(text: str) -> list[str]:
    """Comments of a module, successive lines joined."""
    blocks = [re.sub(r"\n\s*# ?", " ", block[0]) for block in COMMENT.finditer(text)]
    return [block.strip("# ") for block in blocks if not re.match(r"\s*# (?:noqa|type:)", block)]


def text_faults(text: str) -> list[str]:
    """Host names of package registries, paths of one machine, and files outside the repository."""
    found = [f"host {host}" for host in HOSTS if host in text]
    found += [f"machine path {match[0]}" for match in MACHINE_PATH.finditer(text)]
    found += [f"outside the repository: {match[0]}" for match in OUTSIDE.finditer(text)]
    return found


def is_text(content: bytes) -> bool:
    try:
        content.decode()
    except UnicodeDecodeError:
        return False
    return b"\0" not in content


@pytest.fixture(scope="module")
def contents(tracked_files: tuple[Path, ...], root: Path) -> dict[str, bytes]:
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in tracked_files}


@pytest.fixture(scope="module")
def texts(contents: dict[str, bytes]) -> dict[str, str]:
    return {name: content.decode() for name, content in contents.items() if is_text(content)}


def test_coined_words_stay_out(texts: dict[str, str]) -> None:
    judged = {
        name: text
        for name, text in texts.items()
        if Path(name).suffix in SUFFIXES and name not in EXEMPT and Path(name).parent != Path("scenes")
    }
    found = {name: coined(name) + coined(text) for name, text in judged.items()}
    assert {name: words for name, words in found.items() if words} == {}


def test_text_names_nothing_of_one_machine(texts: dict[str, str]) -> None:
    assert len(texts) > 20
    assert {name: text_faults(text) for name, text in texts.items() if text_faults(text)} == {}


def test_no_comment_holds_code(texts: dict[str, str]) -> None:
    modules = {name: text for name, text in texts.items() if name.endswith(".py")}
    assert len(modules) > 200
    swallowed = {name: [c for c in comments(text) if SWALLOWED.search(c)] for name, text in modules.items()}
    assert {name: found for name, found in swallowed.items() if found} == {}


def test_no_large_binary_and_no_generated_file(contents: dict[str, bytes]) -> None:
    large = [name for name, content in contents.items() if len(content) > LARGEST_BINARY_BYTES]
    assert [name for name in large if not is_text(contents[name])] == []
    generated = {".html", ".vtu", ".png", ".pdf", ".pyc", ".whl"}
    # The one picture that only a browser draws: tools/panel_picture.py.
    kept = {"docs/pictures/panel.png"}
    assert [
        name
        for name in contents.keys() - kept
        if Path(name).suffix in generated and "templates" not in Path(name).parts
    ] == []


@pytest.mark.parametrize(
    "text",
    [
        "class LadderChoice:",
        '"the limit "\n    "drowns in noise"',
        "the gas\ntimes of a chamber",
        "(/ro" + "ot/.cache)",
        "data from ../" + "shared/x.csv",
        "https://files.pythonhosted" + ".org/packages",
    ],
)
def test_coined_words_and_machine_paths_are_seen(text: str) -> None:
    assert len(coined(text) + text_faults(text)) == 1


@pytest.mark.parametrize(
    "text",
    ["Runge and Kutta, tornado, torque", "minimum_gas_time", '"rungs": []', "force/work done, $(HOME)/home"],
)
def test_other_texts_are_let_through(text: str) -> None:
    assert coined(text) + text_faults(text) == []


def test_swallowed_code_is_seen() -> None:
    assert SWALLOWED.search(comments("# In three\n# dimensions. sert rates(x)[-1] == approx(order)\n")[0])
