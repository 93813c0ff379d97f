"""JSON documents of the commands: every key is documented, every documented key is printed, and
`to_dict()` of what the functions of the same names answer is the same document.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.cli import main
from ringbalance.controller.balancer import Draws
from ringbalance.controller.judging import remedies as remedies_module
from ringbalance.controller.judging import search as search_module
from ringbalance.controller.judging import tune as tune_module
from ringbalance.controller.judging.holding import Endurance
from ringbalance.controller.judging.judge import judged_all
from ringbalance.scene.changes import document_of
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.toml import toml_bytes
from ringbalance.verification.extremes.study import Size, find_extremes

PAGE: Final = Path(__file__).resolve().parents[1] / "docs" / "commands.md"
SHARED: Final = "Keys that several commands have"
PAPER, DRIVEN = (str(rb.bundled_scene(name)) for name in ("liquid_ring_paper", "driven_masses_small"))
MEASUREMENTS: Final = Path(PAPER).parent / "measurements"
MODELS: Final = "rungs"
BY_NAME: Final = {
    *("tube.terms", "tube.uncertainty_parts", "fill_ratio", "settings", "gain", "outcomes"),
    *("held", "pulls", "times"),
    *(f"quantities.{MODELS}.{each}" for each in ("models", "work", "fixed_work")),
    f"times.{MODELS}",
    *("findings.values", "findings.change"),
    *("verdicts", "best.changes"),
    *("ended", "own.ended", "along.levels.ended", "clipped", "along.levels.settings", "tried.settings"),
    *("ideal_part.ended", "ideal_part.settings"),
    *(f"{each}.{key}" for each in ("remedies", "valves") for key in ("changes", "settings")),
    *(
        "quantities.causes",
        "numbers",
        "tables.columns",
        "tables.units",
        "endings",
        "loop_endings",
        "violations.point",
    ),
}
"""Whose keys are names of what the scene, the fit or the case has."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scenes: the paper's with a short time limit, with a gas line, and with a runout of the sensor."""
    answers = tmp_path_factory.mktemp("scenes")
    short = rb.load_scene(PAPER).with_values({"run.time_limit": "6 s"})
    line = {"gas.conductance": "2 l/(s*bar)", "gas.critical_ratio": 0.3, "gas.valve_lag": "5 ms"}
    read = {"sensor.runout": {"amplitude": "0.01 um"}}
    scenes = {"short": short, "line": short.with_values(line), "read": short.with_values(read)}
    for name, scene in scenes.items():
        (answers / f"{name}.toml").write_bytes(toml_bytes(document_of(scene)))
    return answers


@pytest.fixture
def printed(capsys: pytest.CaptureFixture[str]) -> Any:
    """Runs a command with `--json`, once in this module for each set of words."""

    def run(*words: object) -> Any:
        return json.loads(_printed(tuple(map(str, words)), capsys))

    return run


_KEPT: Final[dict[tuple[str, ...], str]] = {}


def _printed(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> str:
    if words not in _KEPT:
        capsys.readouterr()
        main([*words, "--json"])
        _KEPT[words] = capsys.readouterr().out
    return _KEPT[words]


@cache
def rows(heading: str) -> dict[str, tuple[set[str], set[str]]]:
    """By top-level key: words in code type of its rows, and paths in their first column."""
    section = PAGE.read_text(encoding="utf-8").split(f"## {heading}\n")[1].split("\n## ")[0]
    answers: dict[str, tuple[set[str], set[str]]] = {}
    for line in section.splitlines():
        cells = re.split(r"(?<!\\)\|", line)
        if line.startswith("| `"):
            paths = re.findall(r"`([^`]+)`", cells[1])
            for path in paths:
                words, firsts = answers.setdefault(re.split(r"\.|\[", path)[0], (set(), set()))
                words |= {word.split(".")[-1].split("]")[-1] for word in re.findall(r"`([^`]+)`", line)}
                firsts.add(path.replace("[]", ""))
    return answers


def paths(value: Any, parent: str = "") -> Iterator[tuple[str, str]]:
    """Place and key of every entry of nested tables and lists; keys that are names count as "*"."""
    if isinstance(value, dict):
        for key, inside in value.items():
            key_or_star = "*" if parent in BY_NAME else key
            yield parent, key_or_star
            yield from paths(inside, f"{parent}.{key_or_star}" if parent else key_or_star)
    elif isinstance(value, list):
        for each in value:
            if isinstance(each, dict | list):
                yield from paths(each, parent)


def compare(heading: str, documents: list[Any], *, as_in: str = "") -> None:
    """Every key that is printed is in the tables, and every path of the first columns is printed.

    Args: `as_in`: heading of the section whose words of the same top-level keys count, too.
    """
    listed, shared = rows(heading), rows(SHARED)
    for top, (words, _) in rows(as_in).items() if as_in else ():
        if top in listed:
            listed[top] = (listed[top][0] | words, listed[top][1])
    printed = {pair for document in documents for pair in paths(document)}
    missing = []
    for parent, key in printed:
        top = (parent or key).split(".")[0]
        words = listed.get(top, (set(), set()))[0] | (
            shared[top][0] if top in listed and top in shared else set()
        )
        # A record within another is the one of its name, such as a fraction.
        words = words | listed.get(parent.split(".")[-1], (set(), set()))[0]
        if key != "*" and key not in words:
            missing.append(f"{parent}.{key}".strip("."))
    assert sorted(missing) == []
    printed_paths = {f"{parent}.{key}".strip(".") for parent, key in printed}
    promised = {path for _, firsts in listed.values() for path in firsts}
    assert sorted(promised - printed_paths) == []


def test_keys_of_calibrate(folder: Path, printed: Any) -> None:
    scenes = (PAPER, folder / "line.toml", rb.bundled_scene("imported_chamber"))
    compare("`calibrate --json`", [printed("calibrate", scene) for scene in scenes])


def test_keys_of_simulate(folder: Path, printed: Any) -> None:
    answers = [printed("simulate", folder / f"{name}.toml") for name in ("short", "line", "read")]
    compare("`simulate --json`", answers)
    assert [len(each["gas_line_runs"]) for each in answers] == [2, 0, 2]


def test_keys_of_simulate_of_eccentric_masses(printed: Any) -> None:
    compare("`simulate --json` of eccentric masses", [printed("simulate", DRIVEN)])


@pytest.fixture(scope="module", autouse=True)
def few_devices() -> Iterator[None]:
    """The keys are those of many."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tune_module, "judged_all", partial(judged_all, first=8, most=8))
        patch.setattr(tune_module, "BLOCK", 8)
        patch.setattr(remedies_module, "_FIRST_DEVICES", 4)
        patch.setattr(tune_module, "searched", lambda *_, **__: {"controller.gas_time_offset": (1e-3,)})
        patch.setattr(search_module, "_HEATS", ((0, 4),))
        patch.setattr(search_module, "_WIDE_ROUNDS", 1)
        patch.setattr(search_module, "DEVICES", 4)
        patch.setattr(search_module, "_SCAN_DRAWS", (Draws.block(64, 2), Draws.block(66, 2)))
        yield


def test_keys_of_tune(folder: Path, printed: Any) -> None:
    documents = [printed("tune", folder / f"{name}.toml") for name in ("short", "line")]
    one = {"rates": np.array([0.01]), "losses": np.zeros(1), "meets": np.ones((1, 1), dtype=np.bool_)}
    held = Endurance(required_fraction=0.9, **one).document()
    compare("`tune --json`", [*documents, documents[0] | {"endurance": held}])


def test_keys_of_tune_of_eccentric_masses() -> None:
    """Three seconds, in which none settles: sixteen devices decide."""
    scene = rb.load_scene(DRIVEN).with_values({"run.time_limit": 1.0})
    compare("`tune --json` of eccentric masses", [rb.tune(scene).to_dict()], as_in="`tune --json`")


def test_keys_of_fit(printed: Any) -> None:
    compare("`fit --json`", [printed("fit", PAPER, MEASUREMENTS / "trial_weight.csv")])


def test_keys_of_compare(folder: Path, printed: Any) -> None:
    compare("`compare --json`", [printed("compare", folder / "short.toml", folder / "line.toml")])


def test_keys_of_doctor(printed: Any) -> None:
    compare("`doctor --json`", [printed("doctor")])


def test_keys_of_trade(printed: Any) -> None:
    compare("`trade --json`", [printed("trade", PAPER, "--level", "light")])


def test_keys_of_sweep(printed: Any, tmp_path: Path) -> None:
    words = ("sweep", PAPER, "--vary", "tube.bore=1mm:2mm:2", "--out", tmp_path, "--check", 1, "--no-figures")
    compare("`sweep --json`", [printed(*words)])


def test_keys_of_verify(printed: Any) -> None:
    cases = ("manufactured_2d", "claim_01_volume")
    compare("`verify --json`", [printed("verify", *cases, "--mutations")])


def test_keys_of_verify_with_data(printed: Any) -> None:
    data = PAGE.parents[1] / "verification" / "validation" / "data" / "senecal_1951.csv"
    answer = printed("verify", "--data", data)
    # Series by their own names.
    compare("`verify --data --json`", [answer | {"series": list(answer["series"].values())}])


@pytest.mark.heavy
def test_keys_of_extremes() -> None:
    scene = liquid_ring_scene(rb.load_scene(PAPER))
    answers = find_extremes(scene, size=Size(points=1, sweep=2, fineness=1.0))
    violated = answers.to_dict() | {"violations": [{"point": {"speed": 1.0}, "violations": []}]}
    compare("`extremes --json`", [violated])


@pytest.mark.parametrize("words", [("calibrate", PAPER), ("simulate", DRIVEN)])
def test_each_command_names_its_scene(words: tuple[str, str], printed: Any) -> None:
    scene = rb.load_scene(words[1])
    expected = {"name": scene.name, "source": scene.source, "sha256": scene.sha256}
    assert printed(*words)["scene"] == expected


def as_json(result: Any) -> Any:
    """Result of `to_dict` as it reads back from JSON."""
    return json.loads(json.dumps(result.to_dict(), allow_nan=False))


@pytest.mark.parametrize("name", ["short", "line"])
def test_to_dict_is_what_the_command_prints(name: str, folder: Path, printed: Any) -> None:
    path = folder / f"{name}.toml"
    scene = rb.load_scene(path)
    assert as_json(rb.calibrate(scene)) == printed("calibrate", path)
    run = printed("simulate", path)
    assert as_json(rb.simulate(scene)) == run
    assert run["scene"] == {"name": scene.name, "source": path.name, "sha256": scene.sha256}


@pytest.mark.heavy
def test_to_dict_of_a_tuning_is_what_the_command_prints(folder: Path, printed: Any) -> None:
    path = folder / "line.toml"
    assert as_json(rb.tune(rb.load_scene(path), remedies=None)) == printed("tune", path)


def test_to_dict_of_studies_is_what_the_command_prints(folder: Path, printed: Any) -> None:
    data, short, line = MEASUREMENTS / "trial_weight.csv", folder / "short.toml", folder / "line.toml"
    scene = rb.load_scene(PAPER)
    assert as_json(rb.fit(scene, data)) == printed("fit", PAPER, data)
    compared = rb.compare(rb.load_scene(short), rb.load_scene(line))
    assert as_json(compared) == printed("compare", short, line)
    timed = as_json(rb.trade(scene, level="light")) | {"times": None}
    assert timed == printed("trade", PAPER, "--level", "light") | {"times": None}
    assert as_json(rb.simulate(rb.load_scene(DRIVEN))) == printed("simulate", DRIVEN)
