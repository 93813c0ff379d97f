"""Half-widths (95 %) of a calibrated law as a table over fill and pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, kw_only=True, eq=False)
class HalfWidths:
    """Expanded uncertainties (95 %) over fill and pressure, linear between nodes and constant beyond.

    The opposite chamber holds the rest of the pair's liquid.  The pressure is that of gas and liquid together
    at the driven chamber's outer wall, because columns separate, and gas leaves the crest, at nearly equal
    wall pressures for all fills.  Where a port is uncovered a half-width jumps; the table interpolates there.
    """

    fill_ratio: FloatArray
    """Fill ratios of the driven chamber, shape (n,), growing."""
    wall_pressure: FloatArray
    """Gauge pressure of gas and liquid at the outer wall of the driven chamber, Pa, shape (m,), growing."""
    velocity: FloatArray
    """Half-width of the velocity, m/s, shape (2 n m,): of a tube that is not primed, then of a primed one."""
    margin: FloatArray
    """Half-width of the margin over the crest, Pa, in the order of `velocity`: the pressure that drives a
    column up to the crest less the loss of a full siphon up to it; zero without a crest."""

    def at(
        self, fill_ratio: FloatArray, wall_pressure: FloatArray, primed: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """Half-widths of the velocity, m/s, and of the margin over the crest, Pa."""
        count = self.wall_pressure.size
        (i, s), (j, t) = _cell(self.fill_ratio, fill_ratio), _cell(self.wall_pressure, wall_pressure)
        row = (primed * self.fill_ratio.size + i) * count + j
        low, high = (
            np.stack([(1 - t) * each[at] + t * each[at + 1] for each in (self.velocity, self.margin)])
            for at in (row, row + count)
        )
        velocity, margin = (1 - s) * low + s * high
        return velocity, margin


def _cell(nodes: FloatArray, x: FloatArray) -> tuple[IntArray, FloatArray]:
    """Index of the interval that holds x, or of the nearest one, and the position in it from 0 to 1."""
    cell = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, nodes.size - 2)
    return cell, np.clip((x - nodes[cell]) / (nodes[cell + 1] - nodes[cell]), 0.0, 1.0)
