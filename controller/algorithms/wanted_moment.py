"""From a wanted change of the disc's moment to the fills of its pairs, in plain numbers."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.loop_records import Record
from ringbalance.controller.moment_table import pair_moment
from ringbalance.scene.platform.compiled import in_place

END_STEP: Final = 1e-3
"""Share of the range of x over which a slope at its end is taken."""
_HALVINGS: Final = 60


@in_place
def fill_for_moment(
    nodes: npt.NDArray[np.complex128],
    first: float,
    step: float,
    wanted: float,
    lowest: float,
    highest: float,
) -> float:
    """Fill ratio of the positive chamber at which a pair has a moment, kg m, growing with that fill.

    Beyond the ends it continues straight, so that it may lie outside [lowest, highest].
    """
    if highest <= lowest:
        return lowest
    short = END_STEP * (highest - lowest)
    low, high = pair_moment(nodes, first, step, lowest).real, pair_moment(nodes, first, step, highest).real
    if wanted <= low:
        rise = pair_moment(nodes, first, step, lowest + short).real - low
        return lowest + (wanted - low) / rise * short
    if wanted >= high:
        rise = high - pair_moment(nodes, first, step, highest - short).real
        return highest + (wanted - high) / rise * short
    for _ in range(_HALVINGS):
        middle = (lowest + highest) / 2.0
        if pair_moment(nodes, first, step, middle).real >= wanted:
            highest = middle
        else:
            lowest = middle
    return highest


@in_place
def split_change(wanted: complex, run: Record, axis: npt.NDArray[np.complex128], half: int) -> None:
    """Split a change of the disc's moment over its pairs, kg m, each within its bounds `least` and `most`.

    The change goes to the two directions on either side of it; what a pair cannot give goes to the pairs that
    are left; what no pair can give is asked, by its component, of those already at their ends, for the fills
    are only assumed.  The result is in `change`.
    Source: section 4.2 of the liquid-ring paper, by oblique components for other numbers of chambers.
    """
    for i in range(half):
        run.fixed[i], run.change[i] = 0, 0.0
    for _ in range(half):
        left = wanted
        for i in range(half):
            left -= run.change[i] * axis[i] if run.fixed[i] != 0 else 0.0
        _share(left, run, axis, half)
        over = False
        for i in range(half):
            held = min(max(run.change[i], run.least[i]), run.most[i])
            if run.fixed[i] == 0 and held != run.change[i]:
                run.fixed[i], run.change[i], over = 1 if run.change[i] > held else -1, held, True
        if not over:
            break
    missing = wanted
    for i in range(half):
        missing -= run.change[i] * axis[i]
    for i in range(half):
        component = (missing * axis[i].conjugate()).real
        # Only in the sense in which the pair was asked for more than it has.
        if run.fixed[i] * component > 0.0:
            run.change[i] += component


@in_place
def _share(wanted: complex, run: Record, axis: npt.NDArray[np.complex128], half: int) -> None:
    """Components along the two free neighbouring directions; along the axis when only one is free."""
    first, last, free = -1, -1, 0
    for i in range(half):
        if run.fixed[i] == 0:
            run.change[i], free, last = 0.0, free + 1, i
            first = i if first < 0 else first
    if free == 1:
        run.change[last] = (wanted * axis[last].conjugate()).real
    if free < 2:
        return
    before, sign, slack = last, -1.0, -1e-12 * abs(wanted)
    # Round once: from the last free axis, seen backwards, to the first one, and over the next to the last.
    for turn in range(2 * half):
        i, here = turn % half, 1.0 if turn < half else -1.0
        if run.fixed[i] != 0:
            continue
        a, b = sign * axis[before], here * axis[i]
        between = (a.conjugate() * b).imag
        one, two = (wanted.conjugate() * b).imag / between, (a.conjugate() * wanted).imag / between
        if min(one, two) >= slack:
            run.change[before], run.change[i] = sign * max(one, 0.0), here * max(two, 0.0)
            return
        before, sign = i, here
