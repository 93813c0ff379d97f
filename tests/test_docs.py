"""The documentation is compared with the program: links, commands, scene, Python code and JSON keys."""

from __future__ import annotations

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import ringbalance as rb
from ringbalance.commands import COMMANDS
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.registry import GROUP

ROOT = Path(__file__).resolve().parents[1]
PAGES = (
    "README.md",
    "CONTRIBUTING.md",
    *(page.relative_to(ROOT).as_posix() for page in sorted((ROOT / "docs").rglob("*.md"))),
)
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")
FENCE = re.compile(r"```(\w+)\n(.*?)```", re.DOTALL)


def text(page: str) -> str:
    return (ROOT / page).read_text(encoding="utf-8")


def fenced(page: str, language: str) -> str:
    """The first block of code of a language."""
    return next(str(body) for name, body in FENCE.findall(text(page)) if name == language)


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
    listed = re.findall(r"^\| `ringbalance ([\w-]+)", text(page), re.MULTILINE)
    assert sorted(listed) == sorted(COMMANDS)


def test_the_readme_opens_with_two_small_pictures_that_pages_draw() -> None:
    opening = text("README.md").split("\n\n")[1]
    pictures = re.findall(r"\| !\[[^\]]+\]\(([^)]+)\)<br>`ringbalance ", opening)
    assert len(pictures) == 2
    assert sum((ROOT / each).stat().st_size for each in pictures) < 300_000
    pages_text = text("docs/tutorials/watch-it-balance.md") + text("docs/tutorials/first-report.md")
    assert all(Path(each).name in pages_text for each in pictures)


def test_the_readme_s_scene_is_one(tmp_path: Path) -> None:
    (tmp_path / "my_disc.toml").write_text(fenced("README.md", "toml"))
    assert liquid_ring_scene(rb.load_scene(tmp_path / "my_disc.toml")).disc.chambers == 4


def test_the_readme_s_python_runs_outside_the_tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(compile(fenced("README.md", "python"), "README.md", "exec"), names)
    assert names["flow"].velocity > 0
    assert names["run"].amplitude.size > 1


def test_names_that_pages_mention_exist() -> None:
    """`ringbalance.room.module` and `ringbalance.room.module.name`, and `rb.name`; not the entry points."""
    for page in PAGES:
        for path in re.findall(r"(?<![\w.-])ringbalance((?:\.[a-zA-Z_]\w*)+)", text(page)):
            if f"ringbalance{path}" == GROUP:
                continue
            parts = path.lstrip(".").split(".")
            member: Any = rb
            for depth, part in enumerate(parts, start=1):
                inside = ".".join(["ringbalance", *parts[:depth]])
                is_module = hasattr(member, "__path__") and find_spec(inside) is not None
                member = import_module(inside) if is_module else getattr(member, part)
        for name in re.findall(r"\brb\.([a-zA-Z_]\w*)", text(page)):
            assert name in rb.__all__, f"{page}: rb.{name}"


def test_the_promised_keys_of_verify_are_there(paper_scene: Scene) -> None:
    (case,) = [each.to_dict() for each in rb.run_cases(["claim_01_volume"], scene=paper_scene)]
    assert {"id", "kind", "verdict", "quantities"} <= set(case)
    promised = {"name", "unit", "value", "reference", "error", "uncertainty", "limit", "verdict"}
    assert promised <= set(case["quantities"][0])
