"""The recipes of docs/optimisers.md, each where its package is installed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "optimisers.md"


def names_of(section: str) -> dict[str, Any]:
    """Variables after the blocks of the page's beginning and of a section."""
    head, *sections = PAGE.read_text(encoding="utf-8").split("\n## ")
    (chosen,) = (each for each in sections if each.startswith(section))
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", head + chosen, re.S):
        exec(compile(block, str(PAGE), "exec"), names)
    return names


@pytest.mark.filterwarnings("ignore")
def test_optuna_finds_a_design_that_serves_nearly_all() -> None:
    pytest.importorskip("optuna")
    names = names_of("Optuna")
    assert names["study"].best_value >= 0.9
    assert 0.4e-3 <= names["best"]["tube.bore"] <= 1e-3


@pytest.mark.filterwarnings("ignore")
def test_pymoo_finds_a_front() -> None:
    pytest.importorskip("pymoo")
    front = names_of("pymoo")["front"]
    order = front.F[:, 0].argsort()
    assert len(front.F) >= 2
    assert (front.F[order, 1][1:] <= front.F[order, 1][:-1]).all()


@pytest.mark.filterwarnings("ignore")
def test_openmdao_finds_the_end_of_the_range() -> None:
    """The velocity grows with the pressure."""
    pytest.importorskip("openmdao")
    assert names_of("OpenMDAO")["pressure"] == pytest.approx(0.7e6, rel=1e-3)
