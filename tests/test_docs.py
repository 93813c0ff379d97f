"""The documentation is compared with the program: links, commands, scene, Python code and JSON keys."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

import ringbalance as rb
from ringbalance.cli import COMMANDS
from ringbalance.controller.document import simulation_document
from ringbalance.controller.line_runs import line_runs_document
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.document import results_document

ROOT = Path(__file__).resolve().parents[1]
PAGES = (
    "README.md",
    "CONTRIBUTING.md",
    *(f"docs/{page.name}" for page in sorted((ROOT / "docs").glob("*.md"))),
)
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")
FENCE = re.compile(r"```(\w+)\n(.*?)```", re.DOTALL)
CODE = re.compile(r"`([a-zA-Z0-9_.]+)`")


def text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def fenced(page: str, language: str) -> str:
    """The first block of code of a language."""
    return next(str(body) for name, body in FENCE.findall(text(page)) if name == language)


def first_column(page: str, heading: str) -> list[str]:
    """Words in code type in the first column of the tables below a heading."""
    section = text(page).split(f"## {heading}\n")[1].split("\n## ")[0]
    cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("|")]
    return [word for cell in cells for word in CODE.findall(cell)]


def has_path(document: Mapping[str, Any], path: str) -> bool:
    """Whether `a.b` stands in nested mappings."""
    here: Any = document
    for part in path.split("."):
        if not isinstance(here, Mapping) or part not in here:
            return False
        here = here[part]
    return True


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    targets = LINK.findall(text(page))
    assert [target for target in targets if not (ROOT / page).parent.joinpath(target).exists()] == []


@pytest.mark.parametrize("page", PAGES)
def test_links_into_a_page_lead_to_a_heading(page: str) -> None:
    for target, anchor in re.findall(r"\]\(([^)#:]*)#([^)]+)\)", text(page)):
        headings = re.findall(
            r"^#+ (.*)$",
            ((ROOT / page).parent / target).read_text(encoding="utf-8") if target else text(page),
            re.MULTILINE,
        )
        assert anchor in {
            re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings
        }, anchor


@pytest.mark.parametrize("page", ["README.md", "docs/commands.md"])
def test_the_commands_are_those_registered(page: str) -> None:
    told = re.findall(r"^\| `ringbalance (\w+)", text(page), re.MULTILINE)
    assert sorted(told) == sorted(COMMANDS)


def test_the_readme_s_scene_is_one(tmp_path: Path) -> None:
    (tmp_path / "my_disc.toml").write_text(fenced("README.md", "toml"))
    assert liquid_ring_scene(rb.load_scene(tmp_path / "my_disc.toml")).disc.chambers == 4


def test_the_readme_s_python_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    names: dict[str, Any] = {}
    exec(compile(fenced("README.md", "python"), "README.md", "exec"), names)
    assert names["flow"].velocity > 0
    assert names["run"].amplitude.size > 1


def test_the_promised_keys_of_calibrate_are_there(paper_scene: Scene) -> None:
    document = calibration_document(rb.calibrate(paper_scene))
    keys = first_column("docs/commands.md", "`calibrate --json`")
    assert len(keys) > 20
    assert [key for key in keys if not has_path(document, key)] == []


def test_the_promised_keys_of_simulate_are_there(paper_scene: Scene) -> None:
    run = rb.simulate(paper_scene, flow_law=rb.paper_law(paper_scene))
    keys = first_column("docs/commands.md", "`simulate --json`")
    assert len(keys) > 8
    # The command adds the runs at the ends of a gas line's range.
    document = simulation_document(run) | {"gas_line_runs": line_runs_document(())}
    assert [key for key in keys if not has_path(document, key)] == []


def test_the_promised_keys_of_verify_are_there(paper_scene: Scene) -> None:
    (case,) = results_document(rb.run_cases(["claim_01_volume"], scene=paper_scene))
    assert {"id", "kind", "verdict", "quantities"} <= set(case)
    promised = {"name", "unit", "value", "reference", "error", "uncertainty", "limit", "verdict"}
    assert promised <= set(case["quantities"][0])
