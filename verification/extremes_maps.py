"""Stability maps: one axis, or two together, from end to end with everything else as the scene has it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.verification.extremes_axes import AXES, Axis, axis_of
from ringbalance.verification.extremes_design import Base, Point, judged
from ringbalance.verification.extremes_point import Ending, Judgement

FloatArray = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]

PAIRS: Final = (
    ("speed", "fill"),
    ("viscosity", "bore"),
    ("angle", "plate"),
    ("speed", "pressure"),
    ("gain", "noise"),
    ("gain", "period"),
)


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """One axis from end to end."""

    axis: Axis
    values: FloatArray
    """In the axis' unit, ascending, shape (n,)."""
    judgements: tuple[Judgement, ...]

    def solved(self) -> tuple[float, float] | None:
        """First and last value that got an answer, with or without a reservation; None for none."""
        good = [v for v, j in zip(self.values, self.judgements, strict=True) if answered(j)]
        return (float(good[0]), float(good[-1])) if good else None

    def beyond(self) -> tuple[str, ...]:
        """What the program says past either end of that, each message once."""
        told = (j.text for j in self.judgements if not answered(j))
        return tuple(dict.fromkeys(told))


@dataclass(frozen=True, kw_only=True)
class StabilityMap:
    """Two axes together."""

    x: Axis
    y: Axis
    x_values: FloatArray
    y_values: FloatArray
    judgements: tuple[Judgement, ...]
    """Row by row: all x for the first y, then for the next."""

    def at(self, row: int, column: int) -> Judgement:
        """One cell.

        Args:
            row: index of y.
            column: index of x.

        Returns:
            Judgement.
        """
        return self.judgements[row * self.x_values.size + column]


def answered(judgement: Judgement) -> bool:
    """Whether a point got an answer, with or without a reservation.

    Args:
        judgement: of the point.

    Returns:
        False when it was refused or broke.
    """
    return judgement.ending not in (Ending.REFUSED, Ending.BROKEN)


def sweeps(
    base: Base, *, count: int, workers: int = 1, progress: Progress | None = None
) -> tuple[Sweep, ...]:
    """Every axis alone, from end to end.

    Args:
        base: the scene.
        count: values on each.
        workers: processes.
        progress: of the points; None for silence.

    Returns:
        Sweeps, in the order of the axes.
    """
    values = {axis.name: axis.at(np.linspace(0, 1, count)) for axis in AXES}
    points: list[Point] = [{name: float(v)} for name, column in values.items() for v in column]
    found = judged(base, points, workers=workers, progress=progress)
    return tuple(
        Sweep(axis=axis, values=values[axis.name], judgements=found[k * count : (k + 1) * count])
        for k, axis in enumerate(AXES)
    )


def stability_maps(
    base: Base,
    *,
    count: int,
    pairs: Sequence[tuple[str, str]] = PAIRS,
    workers: int = 1,
    progress: Progress | None = None,
) -> tuple[StabilityMap, ...]:
    """Pairs of axes together, from end to end.

    Args:
        base: the scene.
        count: values along each axis.
        pairs: names of the axes, x first.
        workers: processes.
        progress: of the points; None for silence.

    Returns:
        Maps, in the order of the pairs.
    """
    grid = np.linspace(0, 1, count)
    points: list[Point] = [
        {x: float(vx), y: float(vy)}
        for x, y in pairs
        for vy in axis_of(y).at(grid)
        for vx in axis_of(x).at(grid)
    ]
    found = judged(base, points, workers=workers, progress=progress)
    size = count**2
    return tuple(
        StabilityMap(
            x=axis_of(x),
            y=axis_of(y),
            x_values=axis_of(x).at(grid),
            y_values=axis_of(y).at(grid),
            judgements=found[k * size : (k + 1) * size],
        )
        for k, (x, y) in enumerate(pairs)
    )
