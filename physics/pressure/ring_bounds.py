"""What grid convergence cannot see of a ring's half-widths: rounding, and liquid that gravity moves
unmodelled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.physics.pressure.hydrostatics import displaced_by_gravity, hydrostatic_pressure
from ringbalance.physics.pressure.ring_samples import QUANTITIES, WIDTH, Sample, Turn
from ringbalance.physics.pressure.solve import RotatingLiquid
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Disc

_EPSILON = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, kw_only=True)
class Case:
    """What ring quantities are asked for."""

    disc: Disc
    liquid: RotatingLiquid
    """Without gravity, which `turn` holds."""
    fills: FloatArray
    """Fill ratios, shape (n,)."""
    meshes: tuple[tuple[int, ...], ...]
    """Cells, finest first."""
    turn: Turn

    def rounding_bound(self, *, fill_ratio: float, samples: Sequence[Sample]) -> FloatArray:
        """Bound of the rounding in every column of `Sample.values` on the finest mesh.

        eps [4 R2/depth + 0.2 max(nodes along the depth, depth over the nodes' distance along the arc)^2],
        plus the rounding of a found surface, times the natural size of the column.
        Returns: Bound in the unit of each column, shape (5,); zero for an empty chamber, which is exact.
        Source: coordinates of a film cancel, and narrow cells make the matrix stiff; the factors are five to
            ten times what was seen against closed forms between 1 and 180 degrees and depths down to 10 nm.
        """
        if fill_ratio == 0:
            return np.zeros(WIDTH)
        disc, cells = self.disc, self.meshes[0]
        a = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
        depth, arc = disc.outer_radius - a, 2 * a * float(half_angle(disc=disc, radius=a))
        stiffness = max(2 * cells[0], 2 * cells[1] * depth / arc) ** 2
        moved = max(sample.rounding for sample in samples)
        relative = _EPSILON * (4 * disc.outer_radius / depth + 0.2 * stiffness) + moved
        return relative * _natural_size(case=self, fill_ratio=fill_ratio)

    def stated_widths(
        self, *, samples: Sequence[tuple[Sample, ...]], widths: FloatArray, closed: BoolArray
    ) -> FloatArray:
        """Half-widths of grid convergence, corrected where it does not cover the whole.

        Args: `samples`: that the values come from, by fill ratio and mesh. `widths`: of grid convergence,
            shape (n, 5). `closed`: whether gravity leaves a closed ring, shape (n,).
        Returns: Half-widths, shape (n, 5): zero for an empty chamber but for where its first drop goes; wider
            by all that gravity could do where it breaks the ring; the natural size where a solve failed.
        """
        stated = widths.copy()
        for k, x in enumerate(self.fills):
            displaced = _displaced(self, float(x))
            if x == 0:
                first_drop = QUANTITIES.index("moment_per_volume")
                stated[k] = 0.0
                stated[k, first_drop] = displaced[first_drop]
            elif not all(sample.status.ok for sample in samples[k]):
                stated[k] = _natural_size(case=self, fill_ratio=float(x))
            elif not closed[k]:
                stated[k] += displaced
        return stated


def _natural_size(*, case: Case, fill_ratio: float) -> FloatArray:
    """Size that every column of `Sample.values` would have without symmetry, shape (5,)."""
    disc, density = case.disc, case.liquid.density
    a, outer = float(surface_radius(disc=disc, fill_ratio=fill_ratio)), disc.outer_radius
    volume = fill_ratio * chamber_volume(disc=disc)
    pressure = hydrostatic_pressure(
        density=density, angular_velocity=case.liquid.angular_velocity, inner=a, outer=outer
    )
    moment = density * volume * outer
    return _columns(disc, volume=volume, pressure=pressure, moment=moment, moment_per_volume=density * outer)


def _displaced(case: Case, x: float) -> FloatArray:
    if case.turn.gravity == 0:
        return np.zeros(WIDTH)
    pressure, moment, moment_per_volume = displaced_by_gravity(
        disc=case.disc, density=case.liquid.density, gravity=case.turn.gravity, fill_ratio=np.array([x])
    )[:, 0].tolist()
    return _columns(
        case.disc, volume=0.0, pressure=pressure, moment=moment, moment_per_volume=moment_per_volume
    )


def _columns(
    disc: Disc, *, volume: float, pressure: float, moment: float, moment_per_volume: float
) -> FloatArray:
    """These in their columns, and as force the pressure on the largest wall."""
    force = pressure * disc.central_angle * disc.outer_radius * (disc.axial_width + disc.outer_radius)
    return np.array([volume, pressure, moment, moment_per_volume, force])
