"""A scene at its extremes: every axis, pairs of axes, and a designed set over all of them together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.results.result import CommandResult
from ringbalance.verification.evidence import Level
from ringbalance.verification.extremes.axes import MAP_PREFIX
from ringbalance.verification.extremes.design import Base, Point, design
from ringbalance.verification.extremes.maps import StabilityMap, Sweep, stability_maps, sweeps
from ringbalance.verification.extremes.point import Ending, Judgement

Progress = Callable[[str, int, int], None]
"""Called with what is being done, the points done of it and their number."""
Record = dict[str, Any]

SEED: Final = 1
MOST_SHOWN: Final = 20
"""Violations reported in full."""


@dataclass(frozen=True, kw_only=True)
class Size:
    """How much is looked at."""

    points: int
    """Of the designed set."""
    sweep: int
    """Values on each axis to begin with."""
    fineness: float
    """Share of an axis within which the place is found where points begin to end in another way."""
    grid: int
    """Values along each axis of a map."""


SIZES: Final[Mapping[Level, Size]] = {
    "light": Size(points=40, sweep=7, fineness=0.03, grid=5),
    "heavy": Size(points=5000, sweep=15, fineness=1e-3, grid=9),
}


@dataclass(frozen=True, kw_only=True, repr=False)
class Extremes(CommandResult):
    """What was found."""

    points: tuple[Point, ...]
    judgements: tuple[Judgement, ...]
    """Of the designed set, in the order of its points."""
    sweeps: tuple[Sweep, ...]
    maps: tuple[StabilityMap, ...]

    @property
    def everything(self) -> tuple[Judgement, ...]:
        """Judgements of the designed set, the sweeps and the maps."""
        parts: list[Sweep | StabilityMap] = [*self.sweeps, *self.maps]
        return self.judgements + tuple(j for part in parts for j in part.judgements)

    def lines(self) -> Iterator[str]:
        """For a terminal: how the points ended."""
        everything = self.everything
        yield f"Limits of validity: {len(everything)} points"
        yield ", ".join(f"{count} {ending}" for ending, count in counted(everything).items() if count)
        yield f"invariants violated at {self.broken()} points"
        yield f"largest residual {max((j.residual for j in everything), default=0.0):.2g}"

    def to_dict(self) -> dict[str, Any]:
        """See `document`."""
        return self.document()

    def document(self) -> Record:
        """What was found as plain numbers, lists and texts."""
        everything = self.everything
        return {
            "points": len(self.points),
            "judged": len(everything),
            "endings": counted(everything),
            "loop_endings": dict(Counter(j.loop for j in everything if j.loop)),
            "worst_residual": max((j.residual for j in everything), default=0.0),
            "worst_error_over_half_width": max((j.worst_ratio for j in everything), default=-1.0),
            "violations": _violations(self),
            "axes": [_sweep(sweep) for sweep in self.sweeps],
            "maps": [_map(found) for found in self.maps],
        }

    def tables(self) -> dict[str, dict[str, list[Any]]]:
        """Columns by table: "axes", the spans of each that end alike, and "map of x and y" for each map."""
        spans = [(sweep.axis, span) for sweep in self.sweeps for span in sweep.spans()]
        axes: dict[str, list[Any]] = {
            "axis": [axis.title for axis, _ in spans],
            "unit": [axis.unit for axis, _ in spans],
            "from": [span.low for _, span in spans],
            "to": [span.high for _, span in spans],
            "ending": [str(span.ending) for _, span in spans],
            "loop": [span.loop for _, span in spans],
            "said": [span.text for _, span in spans],
        }
        maps = {f"{MAP_PREFIX}{item.x.name} and {item.y.name}": _map_columns(item) for item in self.maps}
        return {"axes": axes, **maps}

    def broken(self) -> int:
        """Number of points, of all looked at, at which anything was not as it should be."""
        return sum(bool(j.violations) for j in self.everything)


def find_extremes(
    base: Base,
    *,
    size: Size,
    workers: int = 1,
    progress: Progress | None = None,
    kept: Path | None = None,
) -> Extremes:
    """Look at a scene's extremes, with the same result for any number of workers.

    Args: `kept`: file from which an interrupted designed set resumes.
    Raises: OSError: the kept file cannot be read or written.
    """

    def told(what: str) -> Callable[[int, int], None] | None:
        return None if progress is None else lambda done, number: progress(what, done, number)

    points = design(count=size.points, seed=SEED)
    # First, so that a kept file that cannot be used is known at once.
    judgements = base.judged(points, workers=workers, progress=told("designed set"), kept=kept)
    return Extremes(
        points=points,
        judgements=judgements,
        sweeps=sweeps(base, count=size.sweep, fineness=size.fineness, workers=workers, progress=told("axes")),
        maps=stability_maps(base, count=size.grid, workers=workers, progress=told("maps")),
    )


def _map_columns(item: StabilityMap) -> dict[str, list[Any]]:
    places = [(x, y) for y in item.y_values for x in item.x_values]
    return {
        item.x.name: [float(x) for x, _ in places],
        item.y.name: [float(y) for _, y in places],
        "ending": [str(j.ending) for j in item.judgements],
        "loop": [j.loop for j in item.judgements],
    }


def counted(judgements: Sequence[Judgement]) -> dict[str, int]:
    """Points by how they ended, every ending named. Returns: Numbers of points by ending."""
    numbers = Counter(j.ending for j in judgements)
    return {str(ending): numbers[ending] for ending in Ending}


def _violations(extremes: Extremes) -> list[Record]:
    found = [
        {"point": dict(point), "violations": list(judgement.violations)}
        for point, judgement in zip(extremes.points, extremes.judgements, strict=True)
        if judgement.violations
    ]
    alone = extremes.everything[len(extremes.points) :]
    found += [{"point": {}, "violations": list(j.violations)} for j in alone if j.violations]
    return found[:MOST_SHOWN]


def _sweep(sweep: Sweep) -> Record:
    axis, solved = sweep.axis, sweep.solved()
    return {
        "axis": axis.name,
        "title": axis.title,
        "unit": axis.unit,
        "tried": [axis.low, axis.high],
        "answered": None if solved is None else list(solved),
        "beyond": list(sweep.beyond()),
        "spans": [{**asdict(span), "ending": str(span.ending)} for span in sweep.spans()],
        "values": sweep.values.tolist(),
        "ending": [str(j.ending) for j in sweep.judgements],
        "loop": [j.loop for j in sweep.judgements],
        "residual": [j.residual for j in sweep.judgements],
    }


def _map(found: StabilityMap) -> Record:
    shape = (found.y_values.size, found.x_values.size)
    endings = np.array([str(j.ending) for j in found.judgements], dtype=object).reshape(shape)
    loops = np.array([j.loop for j in found.judgements], dtype=object).reshape(shape)

    def axis(of: Any, values: Any) -> Record:
        return {
            "axis": of.name,
            "title": of.title,
            "unit": of.unit,
            "spacing": of.spacing,
            "values": values.tolist(),
        }

    return {
        "x": axis(found.x, found.x_values),
        "y": axis(found.y, found.y_values),
        "ending": endings.tolist(),
        "loop": loops.tolist(),
    }
