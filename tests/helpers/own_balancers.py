"""The example package of docs/examples, and packages that bring other balancers, as if installed."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path
from typing import Final

BALLS: Final = Path(__file__).parents[2] / "docs" / "examples" / "ball-balancer"
EXAMPLE: Final = (BALLS / "ball_balancer" / "balls.toml").read_bytes()


def described(folder: Path, name: str, version: str, points: dict[str, str]) -> None:
    """Write the metadata of an installed package with entry points of balancers."""
    metadata = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = [f"{key} = {value}" for key, value in points.items()]
    (metadata / "entry_points.txt").write_text("\n".join(["[ringbalance.balancers]", *lines, ""]))


def install_balls(folder: Path) -> None:
    """Put the example package where pip would put it."""
    project = tomllib.loads((BALLS / "pyproject.toml").read_text())["project"]
    shutil.copytree(
        BALLS / "ball_balancer", folder / "ball_balancer", ignore=shutil.ignore_patterns("__pycache__")
    )
    described(folder, project["name"], project["version"], project["entry-points"]["ringbalance.balancers"])
