"""Designs by `ringbalance design`, compared with the best of a whole grid; and problems without a solution.

python benchmarks/design_answers.py [PROBLEM ...]

A grid's step in size is at most 2 %.  Its points are tried from the smallest, each with all initial
settings and those that `tune` finds, until one meets the requirement; where the disc is fixed, all points are
tried, for the least gas.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

import ringbalance as rb
from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.trials import rounded
from ringbalance.design.axes import Plan, Point
from ringbalance.design.races import threshold
from ringbalance.design.racing import judged_design, race
from ringbalance.design.space import Space
from ringbalance.results.requirements import MET
from ringbalance.scene.models import Scene

NEAR: Final = 0.05
"""Distance below the required fraction up to which a point of the grid is judged on more devices."""
MEDIUM: Final = {"gas.conductance": "0.8 l/(s*bar)", "gas.critical_ratio": 0.28, "gas.valve_lag": "12 ms"}
LARGE: Final = {"gas.conductance": "1.5 l/(s*bar)", "gas.critical_ratio": 0.36, "gas.valve_lag": "20 ms"}
OPEN: Final = dict.fromkeys(("outer_radius", "axial_width", "pressure", "valves"))


@dataclass(frozen=True, kw_only=True)
class Problem:
    """The bundled spindle design with other ranges to choose from."""

    vary: tuple[str, ...]
    changes: Mapping[str, Any] = field(default_factory=dict)
    stands: str = ""
    """Prefix of the code of the finding that rules out every design; empty: a design exists."""

    @property
    def scene(self) -> Scene:
        """The scene to design."""
        scene = rb.load_scene(rb.bundled_scene("spindle_design"))
        space = {f"design.{key}": value for key, value in {**OPEN, "vary": list(self.vary)}.items()}
        changed = scene.with_values({**MEDIUM, **space, **self.changes})
        assert isinstance(changed, Scene)
        return changed


WIDTHS: Final = "disc.axial_width=18mm:36mm:36:log"
PROBLEMS: Final = {
    "width": Problem(
        vary=("disc.axial_width=10mm:40mm:71:log", "tube.bore=0.8mm", "gas.pressure=0.8MPa"),
        changes={"requirement.fraction": 0.8},
    ),
    "radius": Problem(
        vary=("disc.outer_radius=48mm:60mm:24:log", "tube.bore=0.8mm", "gas.pressure=0.8MPa"),
        changes={"requirement.fraction": 0.8},
    ),
    "width and pressure": Problem(
        vary=(WIDTHS, "gas.pressure=0.5MPa:0.8MPa:6", "tube.bore=0.8mm"),
        changes={"requirement.fraction": 0.8},
    ),
    "width and bore": Problem(
        vary=(WIDTHS, "tube.bore=0.6mm:1.1mm:7:log", "gas.pressure=0.8MPa"),
        changes={"requirement.fraction": 0.8},
    ),
    "width and chambers": Problem(
        vary=(WIDTHS, "disc.chambers=4,6", "tube.bore=0.75mm", "gas.pressure=0.8MPa")
    ),
    "bore and pressure": Problem(
        vary=("tube.bore=0.6mm:1.2mm:8:log", "gas.pressure=0.5MPa:0.8MPa:7"),
        changes={"requirement.fraction": 0.8, "disc.axial_width": "30 mm"},
    ),
    "too large an unbalance": Problem(
        vary=(WIDTHS, "tube.bore=0.6mm:1.1mm:5:log"),
        changes={"rotor.initial_vibration": {"amplitude": "80 um", "phase": "90 deg"}},
        stands="design_none_able",
    ),
    "too little time": Problem(
        vary=(WIDTHS, "tube.bore=0.8mm", "gas.pressure=0.8MPa"),
        changes={**LARGE, "requirement.settling_time": "0.2 s"},
        stands="design_demand",
    ),
    "too little pressure": Problem(
        vary=(WIDTHS, "gas.pressure=0.05MPa:0.1MPa:5", "tube.bore=0.8mm"), stands="design_none_flows"
    ),
    "too little space": Problem(
        vary=("disc.axial_width=4mm:8mm:36:log", "tube.bore=0.6mm:1.1mm:5:log", "gas.pressure=0.8MPa"),
        stands="design_none_able",
    ),
}


def answers(space: Space, points: list[Point]) -> Iterator[tuple[Point, float]]:
    """Points of a grid that meet the requirement, with the median gas energy, J."""
    required_fraction = balancer_of(space.scene).required_fraction()
    for point in points:
        first = race(
            space.hasty,
            point,
            grid_points=None,
            required_fraction=threshold(required_fraction),
            settings=True,
        )
        if first is None or first.judgement.fraction.value < required_fraction - NEAR:
            continue
        judgement = judged_design(space.hasty, point, settings=first.judgement.settings, search=True)
        if judgement is not None and judgement.verdict == MET:
            yield point, float(np.nanmedian(judgement.outcomes.energy))


def best_of_grid(space: Space) -> tuple[float, Point] | None:
    """Size, m^3, or gas, J, of the best point of the grid; None: none meets the requirement."""
    grid = [
        {path: rounded(value) if isinstance(value, float) else value for path, value in each.items()}
        for each in Plan(axes=space.axes).points()
    ]
    points = sorted(map(space.followed, grid), key=space.size)
    met = answers(space, points)
    if space.sized:
        return next(((space.size(point), point) for point, _ in met), None)
    return min(((gas, point) for point, gas in met), key=lambda each: each[0], default=None)


@dataclass(frozen=True, kw_only=True)
class Compared:
    """Result of one problem: design of the search, and best design of the grid."""

    name: str
    value: float | None
    """Size, m^3, or gas, J; None: no design meets the requirement."""
    grid: float | None
    """Value of the grid's best design."""
    codes: tuple[str, ...]
    """Codes of the findings."""
    seconds: float
    """Processor time of the search."""
    grid_seconds: float

    @property
    def beyond(self) -> float:
        """Relative excess of the design over the grid's best; infinite for a wrong answer."""
        if self.value is not None and self.grid is not None:
            return self.value / self.grid - 1
        named = any(code.startswith(PROBLEMS[self.name].stands) for code in self.codes)
        return 0.0 if self.value is self.grid and named else float("inf")

    @property
    def text(self) -> str:
        """Line of output."""
        answer = self.codes[0] if self.value is None else f"{self.value:.4g}"
        best = "none" if self.grid is None else f"{self.grid:.4g}"
        times = f"{self.seconds:.1f} s, grid {self.grid_seconds:.1f} s of processor time"
        return f"{self.name}: {answer}, grid {best}, {self.beyond:+.1%}; {times}"


def compared(name: str) -> Compared:
    """Design a problem, and search its grid."""
    start = time.process_time()
    design = rb.find_design(PROBLEMS[name].scene, workers=1)
    spent = time.process_time() - start
    assert isinstance(design, rb.Design)
    best = best_of_grid(design.space)
    value = None
    if design.succeeded and design.judgement is not None:
        gas = float(np.nanmedian(design.judgement.outcomes.energy))
        value = design.size if design.space.sized else gas
    return Compared(
        name=name,
        value=value,
        grid=None if best is None else best[0],
        codes=tuple(each.code for each in design.rows().findings),
        seconds=spent,
        grid_seconds=time.process_time() - start - spent,
    )


if __name__ == "__main__":
    for chosen in sys.argv[1:] or PROBLEMS:
        print(compared(chosen).text, flush=True)
