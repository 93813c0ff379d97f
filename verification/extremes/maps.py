"""Stability maps: one axis, or two together, from end to end with everything else as the scene has it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.extremes.axes import AXES, Axis, axis_of
from ringbalance.verification.extremes.design import Base, Point
from ringbalance.verification.extremes.point import Ending, Judgement

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
class _Span:
    """A stretch of one axis along which points end alike."""

    low: float
    """First value judged, in the axis' unit."""
    high: float
    """Last value judged."""
    ending: Ending
    loop: str
    """Outcome of the closed loop; empty where there is none."""
    text: str
    """What the program says there: its message or reservation, at the end towards the nearest answer."""


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """One axis from end to end."""

    axis: Axis
    values: FloatArray
    """In the axis' unit, ascending, shape (n,): even steps, and closer ones where the ending changes."""
    judgements: tuple[Judgement, ...]

    def solved(self) -> tuple[float, float] | None:
        """First and last value that got an answer, with or without a reservation; None for none."""
        good = [v for v, j in zip(self.values, self.judgements, strict=True) if answered(j)]
        return (float(good[0]), float(good[-1])) if good else None

    def beyond(self) -> tuple[str, ...]:
        """What the program says past either end of that, each message once."""
        told = (j.text for j in self.judgements if not answered(j))
        return tuple(dict.fromkeys(told))

    def changes(self) -> tuple[int, ...]:
        """Places after which a point ends in another way than the one before."""
        pairs = zip(self.judgements[:-1], self.judgements[1:], strict=True)
        return tuple(i for i, (one, other) in enumerate(pairs) if _alike(one) != _alike(other))

    def spans(self) -> tuple[_Span, ...]:
        """The stretches along which points end alike, from one end of the axis to the other."""
        ends = [*(i + 1 for i in self.changes()), len(self.judgements)]
        starts = [0, *ends[:-1]]
        return tuple(self._span(start, end) for start, end in zip(starts, ends, strict=True))

    def _span(self, start: int, end: int) -> _Span:
        judgement = self.judgements[start]
        # Towards the answers: what is said last below them, and first above.
        said = self.judgements[end - 1 if start == 0 else start]
        return _Span(
            low=float(self.values[start]),
            high=float(self.values[end - 1]),
            ending=judgement.ending,
            loop=judgement.loop,
            text=said.text,
        )


def _alike(judgement: Judgement) -> tuple[Ending, str]:
    return judgement.ending, judgement.loop


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
        """One cell. Args: `row`: index of y. `column`: index of x."""
        return self.judgements[row * self.x_values.size + column]


def answered(judgement: Judgement) -> bool:
    """Whether a point got an answer, with or without a reservation."""
    return judgement.ending not in (Ending.REFUSED, Ending.BROKEN)


def sweeps(
    base: Base, *, count: int, fineness: float, workers: int = 1, progress: Progress | None = None
) -> tuple[Sweep, ...]:
    """Every axis alone, from end to end, as `swept`."""

    def judge_all(places: Sequence[tuple[Axis, float]]) -> Sequence[Judgement]:
        points = [{axis.name: value} for axis, value in places]
        return base.judged(points, workers=workers, progress=progress)

    return swept(AXES, judge_all, count=count, fineness=fineness)


def swept(
    axes: Sequence[Axis],
    judge_all: Callable[[Sequence[tuple[Axis, float]]], Sequence[Judgement]],
    *,
    count: int,
    fineness: float,
) -> tuple[Sweep, ...]:
    """Axes in even steps, then halved wherever neighbours end differently, until each change is found.

    Of changes back and forth within a step some may be missed.
    Args: `count`: values on each to begin with. `fineness`: fraction of an axis to which changes are found.
    """
    grid = np.linspace(0, 1, count)
    found = judge_all([(axis, float(value)) for axis in axes for value in axis.at(grid)])
    made = [
        Sweep(axis=axis, values=axis.at(grid), judgements=tuple(found[k * count : (k + 1) * count]))
        for k, axis in enumerate(axes)
    ]
    while gaps := [(k, i) for k, sweep in enumerate(made) for i in _wide(sweep, fineness)]:
        middles = [_middle(made[k], i) for k, i in gaps]
        more = judge_all([(made[k].axis, value) for (k, _), value in zip(gaps, middles, strict=True)])
        # From the right, so that places to the left stay where they are.
        for (k, i), value, judgement in reversed(list(zip(gaps, middles, more, strict=True))):
            made[k] = _with(made[k], i + 1, value, judgement)
    return tuple(made)


def _wide(sweep: Sweep, fineness: float) -> list[int]:
    """Changes that lie between values further apart than that."""
    places = [sweep.axis.share(float(value)) for value in sweep.values]
    return [i for i in sweep.changes() if places[i + 1] - places[i] > fineness]


def _middle(sweep: Sweep, place: int) -> float:
    low, high = (sweep.axis.share(float(value)) for value in sweep.values[place : place + 2])
    return float(sweep.axis.at((low + high) / 2))


def _with(sweep: Sweep, place: int, value: float, judgement: Judgement) -> Sweep:
    return Sweep(
        axis=sweep.axis,
        values=np.insert(sweep.values, place, value),
        judgements=(*sweep.judgements[:place], judgement, *sweep.judgements[place:]),
    )


def stability_maps(
    base: Base,
    *,
    count: int,
    workers: int = 1,
    progress: Progress | None = None,
) -> tuple[StabilityMap, ...]:
    """Pairs of axes, x first, together from end to end.

    Args: `count`: values along each axis.
    """
    grid = np.linspace(0, 1, count)
    points: list[Point] = [
        {x: float(vx), y: float(vy)}
        for x, y in PAIRS
        for vy in axis_of(y).at(grid)
        for vx in axis_of(x).at(grid)
    ]
    found = base.judged(points, workers=workers, progress=progress)
    size = count**2
    return tuple(
        StabilityMap(
            x=axis_of(x),
            y=axis_of(y),
            x_values=axis_of(x).at(grid),
            y_values=axis_of(y).at(grid),
            judgements=found[k * size : (k + 1) * size],
        )
        for k, (x, y) in enumerate(PAIRS)
    )
