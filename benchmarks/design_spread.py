"""Spread of the results of `ringbalance design`: the bundled spindle with six free quantities, from several
starts of the search and with different drawn devices.

python benchmarks/design_spread.py [STARTS [SEEDS]]

A start is the seed of the tried points; a seed is that of the drawn devices (`run.seed`).  Each design is
checked on devices that no step of its search used.
"""

from __future__ import annotations

import sys
import time
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
            f"start {self.start}, seed {self.seed}: {1e6 * self.design.size:.1f} ml, {keys}; "
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


def main(starts: int = 4, seeds: int = 4) -> None:
    """Print every result, and largest over smallest size."""
    for pairs in ([(start, 0) for start in range(starts)], [(0, seed) for seed in range(1, seeds)]):
        sizes = []
        for start, seed in pairs:
            result = answer(start, seed)
            print(result.text, flush=True)
            sizes.append(result.design.size)
        if sizes:
            print(f"largest over smallest: {max(sizes) / min(sizes) - 1:+.1%}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
