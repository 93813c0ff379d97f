"""Rewrite the tables of docs/how-to-choose.md: the model that each tolerance needs, measured.

python tools/choose_table.py            prints the page with fresh tables
python tools/choose_table.py --write    puts it into docs/how-to-choose.md
"""

from __future__ import annotations

import argparse
import math
import re
from dataclasses import replace
from pathlib import Path

from ringbalance.scene import bundled_scene, load_scene, write_whole
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.selection_studies.choice import choose
from ringbalance.verification.selection_studies.hierarchy import ModelHierarchy, Values
from ringbalance.verification.selection_studies.study import hierarchies_of

PAGE = Path(__file__).resolve().parents[1] / "docs" / "how-to-choose.md"
TOLERANCES = (0.1, 1e-2, 1e-3, 1e-4)
BLOCK = re.compile(r"<!-- table: (\w+) -->\n.*?<!-- end -->", re.DOTALL)
QUICK = ("wall_pressure", "moment", "k")
"""Quantities whose rows take seconds."""


def scenes() -> dict[str, tuple[Scene, tuple[str, ...]]]:
    """Scenes of the page with the quantities that are listed for each."""
    paper = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
    oil = liquid_ring_scene(load_scene(bundled_scene("silicone_oil_100cst")))
    slow = replace(paper, rotor=replace(paper.rotor, speed=600 * math.pi / 30))
    loop = ("velocity", "transferred_mass", "settling_time")
    return {
        "paper": (paper, (*QUICK, *loop)),
        "slow": (slow, ("wall_pressure", "moment")),
        "oil": (oil, ("k", "velocity", "transferred_mass")),
    }


def row(hierarchy: ModelHierarchy) -> str:
    """One row: a quantity with the model for each tolerance and its measured error."""
    cells, values = [], Values(hierarchy)
    for tolerance in TOLERANCES:
        fidelity = choose(hierarchy, tolerance, values=values).fidelity
        error = values.error(fidelity)
        told = "as the finest" if error < 3e-8 else f"{error:.0e}"
        cells.append(f"{fidelity.name} ({told})")
    return f"| {hierarchy.title} | " + " | ".join(cells) + f" | {hierarchy.top_uncertainty:.0e} |"


def table(name: str, *, only: tuple[str, ...] | None = None) -> list[str]:
    """Rows of one scene's table."""
    scene, quantities = scenes()[name]
    wanted = tuple(q for q in quantities if only is None or q in only)
    return [row(hierarchy) for hierarchy in hierarchies_of(scene, wanted)]


def page(text: str) -> str:
    """The page with fresh tables."""
    head = (
        "| quantity | "
        + " | ".join(f"{100 * t:g} %" for t in TOLERANCES)
        + " | uncertainty of the finest model |"
    )
    rule = "|---" * (len(TOLERANCES) + 2) + "|"

    def fresh(match: re.Match[str]) -> str:
        rows = "\n".join([head, rule, *table(match[1])])
        return f"<!-- table: {match[1]} -->\n{rows}\n<!-- end -->"

    return BLOCK.sub(fresh, text)


def main() -> None:
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    fresh = page(PAGE.read_text(encoding="utf-8"))
    if parser.parse_args().write:
        write_whole(PAGE, fresh)
    else:
        print(fresh)


if __name__ == "__main__":
    main()
