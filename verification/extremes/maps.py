"""Stability maps: one axis, or two together, from end to end with everything else as the scene has it.

The numerics have axes of their own: the cells' aspect ratio, and the step of Eq. 20's segments.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.mesh.chamber import default_cells
from ringbalance.mesh.geometry import chamber_volume, liquid_area
from ringbalance.physics.pressure.ring import ring_quantities
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.extremes.axes import AXES, Axis
from ringbalance.verification.extremes.design import Base, Point
from ringbalance.verification.extremes.point import ROUND_OFF, Ending, Judgement
from ringbalance.verification.reference.exact_chamber import exact_wall_pressure
from ringbalance.verification.reference.transfers import closed_form, explicit_segments, paper_drive

Progress = Callable[[int, int], None]

_PAIRS: Final = (
    ("speed", "fill"),
    ("viscosity", "bore"),
    ("angle", "plate"),
    ("speed", "pressure"),
    ("gain", "noise"),
    ("gain", "period"),
)
_ASPECT: Final = Axis("aspect", "aspect ratio of the cells", "1", 1.0, 1e12, usual=(1.0, 1e5))
_STEP: Final = Axis("step", "step of the explicit segments", "s", 1e-7, 100.0, usual=(1e-4, 0.1))
_SHORTEST: Final = 1e-3
"""s, of the operation that steps are taken through; longer steps are the whole operation."""


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
        good = [v for v, j in zip(self.values, self.judgements, strict=True) if _answered(j)]
        return (float(good[0]), float(good[-1])) if good else None

    def beyond(self) -> tuple[str, ...]:
        """What the program says past either end of that, each message once."""
        told = (j.text for j in self.judgements if not _answered(j))
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


def _answered(judgement: Judgement) -> bool:
    """Whether a point got an answer, with or without a reservation."""
    return judgement.ending not in (Ending.REFUSED, Ending.BROKEN)


def sweeps(
    base: Base, *, count: int, fineness: float, workers: int = 1, progress: Progress | None = None
) -> tuple[Sweep, ...]:
    """Every axis alone, from end to end, as `_swept`, those of the numerics last."""

    def judge_all(places: Sequence[tuple[Axis, float]]) -> Sequence[Judgement]:
        points = [{axis.name: value} for axis, value in places]
        return base.judged(points, workers=workers, progress=progress)

    of_inputs = _swept(AXES, judge_all, count=count, fineness=fineness)
    return of_inputs + _numerical_sweeps(base.scene, count=count, fineness=fineness)


def _swept(
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
        for x, y in _PAIRS
        for vy in Axis.of(y).at(grid)
        for vx in Axis.of(x).at(grid)
    ]
    found = base.judged(points, workers=workers, progress=progress)
    size = count**2
    return tuple(
        StabilityMap(
            x=Axis.of(x),
            y=Axis.of(y),
            x_values=Axis.of(x).at(grid),
            y_values=Axis.of(y).at(grid),
            judgements=found[k * size : (k + 1) * size],
        )
        for k, (x, y) in enumerate(_PAIRS)
    )


def _numerical_sweeps(scene: Scene, *, count: int, fineness: float) -> tuple[Sweep, ...]:
    """The numerics' own axes, `_ASPECT` and `_STEP`, as `_swept`."""
    judges = {_ASPECT.name: at_aspect, _STEP.name: at_step}

    def judge_all(places: Sequence[tuple[Axis, float]]) -> list[Judgement]:
        return [judges[axis.name](scene, value) for axis, value in places]

    return _swept((_ASPECT, _STEP), judge_all, count=count, fineness=fineness)


def at_aspect(scene: Scene, aspect: float) -> Judgement:
    """Wall pressure of a ring so thin that the default mesh's cells have that length over depth.

    Returns: Judgement; a ring too thin for any mesh is refused with the program's own message.
    """
    disc = scene.disc
    radial, angular = default_cells(disc=disc)
    depth = disc.outer_radius * disc.central_angle / angular / aspect * radial
    a = max(disc.outer_radius - depth, disc.inner_radius)
    fill = float(liquid_area(disc=disc, surface_radius=a)) * disc.axial_width / chamber_volume(disc=disc)
    density, omega = scene.liquid.density, abs(scene.rotor.speed)
    try:
        ring = ring_quantities(disc=disc, fill_ratio=fill, density=density, angular_velocity=omega)
    except ValueError as refused:
        return Judgement(ending=Ending.REFUSED, text=str(refused))
    exact = float(exact_wall_pressure(disc=disc, fill_ratio=fill, density=density, angular_velocity=omega))
    error = abs(float(ring.wall_pressure.value[0]) - exact)
    ratio = error / (float(ring.wall_pressure.uncertainty[0]) + ROUND_OFF * exact)
    faults = (f"an error is {ratio:.3g} times its half-width",) if ratio > 1 else ()
    return Judgement(
        ending=Ending.BROKEN if faults else Ending.SOLVED,
        text="",
        violations=faults,
        residual=ring.statistics.relative_residual,
        worst_ratio=ratio,
    )


def at_step(scene: Scene, step: float) -> Judgement:
    """An injection under the paper's law in explicit segments of one length, against the closed form.

    The error of a segment is at most half its length times the change of the rate over it; `worst_ratio` is
    the error over that bound.
    """
    law = paper_law(scene)
    fill = scene.disc.initial_fill
    drive = paper_drive(law, gas_pressure=scene.gas.pressure, fill=fill, total=2 * fill)
    duration = max(step, _SHORTEST)
    instants = np.array([duration])
    exact = closed_form(drive, instants)
    found = explicit_segments(max(1, round(duration / step)))(drive, instants)
    start = abs(float(drive.flow(drive.fill, primed=False).velocity))
    bound = drive.exchange_rate * start * step + ROUND_OFF
    error = abs(float(found.fill[-1]) - float(exact.fill[-1]))
    faults = []
    if not (drive.lowest <= found.fill[-1] <= drive.highest):
        faults.append("a fill ratio leaves its bounds")
    if error > bound:
        faults.append(f"an error of {error:.3g} is above its bound of {bound:.3g}")
    coarse = error > scene.tolerance * drive.fill
    return Judgement(
        ending=Ending.BROKEN if faults else Ending.STATUS if coarse else Ending.SOLVED,
        text="the segments' error is above the tolerance: take shorter ones" if coarse else "",
        violations=tuple(faults),
        worst_ratio=error / bound,
    )
