"""The plain report of a third balancer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from check_traces import traces, untrue
from own_balancers import EXAMPLE
from report_texts import page_text

from ringbalance.running import run_command

Record = dict[str, Any]
pytestmark = pytest.mark.usefixtures("ball_registered")


@pytest.fixture(scope="module")
def balls(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of two balls in oil that are too light, 120 g mm against 100; its checks pass."""
    folder = tmp_path_factory.mktemp("balls")
    heavy = EXAMPLE.replace(b"80 g*mm", b"120 g*mm")
    assert heavy != EXAMPLE
    (folder / "balls.toml").write_bytes(heavy)
    assert run_command("report", scene=folder / "balls.toml", out=folder / "out") == 0
    return folder / "out"


def test_a_third_balancer_is_reported(balls: Path) -> None:
    pages = [(balls / name).read_text() for name in ("report.html", "annex.html")]
    evidence = json.loads((balls / "evidence.json").read_text())
    assert untrue(pages, evidence) == []
    assert len(traces(pages)) > 5
    text = page_text(pages[0])
    assert text.count("not met") >= 2
    assert evidence["summary"]["own"]["fraction"]["count"] == 0
    assert (balls / "figures" / "run-amplitude.svg").is_file()
    assert (balls / "tables" / "loop_balanced.csv").read_text().startswith("time [s],amplitude [m]")
