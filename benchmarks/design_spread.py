"""Spread of the results of `ringbalance design`: the bundled spindle with six free quantities, from several
starts of the search and with different drawn devices.

python benchmarks/design_spread.py [START,SEED ...]

A start is the seed of the tried points; a seed is that of the drawn devices (`run.seed`).  Each design is
checked on devices that no step of its search used.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import ringbalance as rb
from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, judged_all
from ringbalance.design.design_rows import design_document, design_rows
from ringbalance.design.designing import run_design
from ringbalance.results.result import Presentation

CHECKED: Final = 4096
"""Further devices on which a design is checked."""


@dataclass(frozen=True, kw_only=True)
class Answer:
    """Result of one search."""

    start: int
    seed: int
    design: rb.Design
    fraction: float
    """Fraction of the further devices that meet the requirement."""
    seconds: float
    """Processor time of the search."""

    @property
    def text(self) -> str:
        """Line of output."""
        point = self.design.point
        keys = (
            f"bore {1e3 * point['tube.bore']:.3g} mm, {point['gas.pressure'] / 1e6:.3g} MPa, "
            f"{', '.join(self.design.space.names(point).values())}"
        )
        return (
            f"start {self.start}, seed {self.seed}: {1e6 * self.design.size:.1f} ml, printed "
            f"{self.design.doubt or math.nan:.1%}, {keys}; "
            f"{self.fraction:.1%} of {CHECKED} further devices; {self.seconds:.0f} s"
        )


def answer(start: int, seed: int) -> Answer:
    """Design the bundled spindle, and check it."""
    scene = rb.load_scene(rb.bundled_scene("spindle_design")).with_values({"run.seed": seed})
    begun = time.process_time()
    presentation = Presentation(document=design_document, rows=design_rows)
    design = run_design(scene, presentation=presentation, workers=1, start=start)
    seconds = time.process_time() - begun
    balancer = balancer_of(design.recommended_scene)
    first = FIRST_VERDICT_DEVICE + CHECKED
    (judgement,) = judged_all(balancer, [{}], first=CHECKED, most=CHECKED, start=first, complete=False)
    return Answer(start=start, seed=seed, design=design, fraction=judgement.fraction.value, seconds=seconds)


def main(pairs: Sequence[str]) -> None:
    """Print every result, and how many lie within what they print of their mean."""
    results = []
    for pair in pairs:
        start, seed = map(int, pair.split(","))
        results.append(answer(start, seed))
        print(results[-1].text, flush=True)
    sizes = [each.design.size for each in results]
    mean = sum(sizes) / len(sizes)
    inside = sum(abs(each.design.size / mean - 1) <= (each.design.doubt or 0.0) for each in results)
    print(f"{inside} of {len(sizes)} within what they print of their mean, {1e6 * mean:.1f} ml;", end=" ")
    print(f"largest over smallest: {max(sizes) / min(sizes) - 1:+.1%}")


if __name__ == "__main__":
    main(sys.argv[1:] or ["0,0", "1,0", "0,1", "1,1"])
