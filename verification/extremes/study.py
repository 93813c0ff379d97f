"""A scene at its extremes: every axis from end to end, and a designed set over all of them together.

The command `ringbalance extremes` prints the study.
"""

from __future__ import annotations

import json as json_format
import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.results.numbers import number
from ringbalance.results.result import Cells, Result, Rows, Table, print_rows
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.changes import document_of
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.loader import load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import staged, write_whole
from ringbalance.scene.platform.processes import checked_workers
from ringbalance.scene.platform.terminal import activity, print_message
from ringbalance.scene.toml import toml_text
from ringbalance.verification.evidence import Level
from ringbalance.verification.extremes.design import AXES, Axis, Base, Point, design
from ringbalance.verification.extremes.design import Progress as Counting
from ringbalance.verification.extremes.point import Ending, Judgement

Progress = Callable[[str, int, int], None]
"""Called with what is being done, the points done of it and their number."""
Record = dict[str, Any]

_DONE: Final = 0
_BROKEN: Final = 1
_FILE: Final = "extremes.json"
_KEPT: Final = "extremes-points.json"
_SEED: Final = 1
_MOST_SHOWN: Final = 20
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


SIZES: Final[Mapping[Level, Size]] = {
    "light": Size(points=40, sweep=7, fineness=0.03),
    "heavy": Size(points=5000, sweep=15, fineness=1e-3),
}


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


def _answered(judgement: Judgement) -> bool:
    """Whether a point got an answer, with or without a reservation."""
    return judgement.ending not in (Ending.REFUSED, Ending.BROKEN)


def _sweeps(
    base: Base, *, count: int, fineness: float, workers: int = 1, progress: Counting | None = None
) -> tuple[Sweep, ...]:
    """Every axis alone, in even steps, then halved wherever neighbours end differently.

    Of changes back and forth within a step some may be missed.
    Args: `count`: values on each to begin with. `fineness`: fraction of an axis to which changes are found.
    """

    def judge_all(places: Sequence[tuple[Axis, float]]) -> Sequence[Judgement]:
        points = [{axis.name: value} for axis, value in places]
        return base.judged(points, workers=workers, progress=progress)

    grid = np.linspace(0, 1, count)
    found = judge_all([(axis, float(value)) for axis in AXES for value in axis.at(grid)])
    made = [
        Sweep(axis=axis, values=axis.at(grid), judgements=tuple(found[k * count : (k + 1) * count]))
        for k, axis in enumerate(AXES)
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


@dataclass(frozen=True, kw_only=True, repr=False)
class Extremes(Result):
    """What was found."""

    points: tuple[Point, ...]
    judgements: tuple[Judgement, ...]
    """Of the designed set, in the order of its points."""
    sweeps: tuple[Sweep, ...]

    @property
    def everything(self) -> tuple[Judgement, ...]:
        """Judgements of the designed set and the sweeps."""
        return self.judgements + tuple(j for sweep in self.sweeps for j in sweep.judgements)

    def rows(self) -> Rows:
        """How the points ended, and where along each axis."""
        everything, worst = self.everything, max((j.worst_ratio for j in self.everything), default=-1.0)
        residual = max((j.residual for j in everything), default=0.0)
        return Rows(
            title=f"Limits of validity: {len(everything)} points",
            quantities=(
                Quantity(key="broken", name="points with a violated invariant", value=float(self.broken())),
                Quantity(key="worst_residual", name="largest residual", value=residual, digits=2),
                Quantity(
                    key="worst_error_over_half_width",
                    name="largest error over its half-width",
                    value=None if worst < 0 else worst,
                    digits=2,
                ),
            ),
            facts=[(ending, str(count)) for ending, count in counted(everything).items() if count],
            findings=tuple(
                Finding(
                    code="invariant_violated",
                    values={
                        "violations": each["violations"],
                        "point": ", ".join(f"{axis} {value:.4g}" for axis, value in each["point"].items()),
                    },
                )
                for each in _violations(self)
            ),
            tables=(
                Table(
                    heads=("input", "stretch", "answer", "loop", "said"),
                    rows=axis_rows(self.tables()["axes"]),
                ),
            ),
        )

    def to_dict(self) -> Record:
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
        }

    def tables(self) -> dict[str, dict[str, list[Any]]]:
        """Columns by table: "axes", the spans of each that end alike."""
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
        return {"axes": axes}

    def broken(self) -> int:
        """Number of points, of all looked at, at which anything was not as it should be."""
        return sum(bool(j.violations) for j in self.everything)


def axis_rows(columns: Record) -> list[Cells]:
    """The stretches of every axis: its title (at its first), stretch, answer, loop and message."""
    before = ["", *columns["axis"]]
    return [
        (
            "" if title == before[index] else title,
            _stretch(columns["from"][index], columns["to"][index], columns["unit"][index]),
            str(columns["ending"][index]).removesuffix(" with a message"),
            str(columns["loop"][index]).replace("_", " "),
            # The first line of a message, without the name of a file that nobody has.
            str(columns["said"][index]).split("\n")[0].split(".toml: ", 1)[-1],
        )
        for index, title in enumerate(columns["axis"])
    ]


def _stretch(low: float, high: float, unit: str) -> str:
    """First and last value, or the one where both are the same."""
    first, last = (number(float(end), digits=3) for end in (low, high))
    ends = first if first == last else f"{first} to {last}"
    return ends if unit == "1" else f"{ends} {unit.replace('^2', '²')}"


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

    points = design(count=size.points, seed=_SEED)
    # First, so that a kept file that cannot be used is known at once.
    judgements = base.judged(points, workers=workers, progress=told("designed set"), kept=kept)
    return Extremes(
        points=points,
        judgements=judgements,
        sweeps=_sweeps(
            base, count=size.sweep, fineness=size.fineness, workers=workers, progress=told("axes")
        ),
    )


def counted(judgements: Sequence[Judgement]) -> dict[str, int]:
    """Points by how they ended, every ending named. Returns: Numbers of points by ending."""
    numbers = Counter(j.ending for j in judgements)
    return {str(ending): numbers[ending] for ending in Ending}


def _violations(extremes: Extremes) -> list[Record]:
    alone = [
        ({sweep.axis.name: float(value)}, judgement)
        for sweep in extremes.sweeps
        for value, judgement in zip(sweep.values, sweep.judgements, strict=True)
    ]
    places = [*zip(extremes.points, extremes.judgements, strict=True), *alone]
    return [
        {"point": dict(point), "violations": list(judgement.violations)}
        for point, judgement in places
        if judgement.violations
    ][:_MOST_SHOWN]


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


def extremes(
    scene: Path,
    *,
    json: bool = False,
    out: Path | None = None,
    level: Level = "light",
    workers: int | None = None,
) -> int:
    """Find the limits of validity of a scene: where results stop, what is reported beyond, and whether the
    invariants hold inside.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        out: also write extremes.json to this folder; after an interrupted run with the same folder the
            designed set resumes where it stopped.
        level: "heavy" judges thousands of points, for an hour or more.
        workers: processes; default one for each core, at most two.

    Returns:
        Exit code: 0; 1 when an invariant was violated at some point.

    Raises:
        SceneError: a scene that cannot be used; nothing is written.
        OSError: the folder cannot be written.
    """
    base = base_of(liquid_ring_scene(load_scene(scene)))
    with nullcontext() if out is None else staged(out, files=(_KEPT, _FILE)) as stage:
        with activity("extremes", "axes") as shown:
            found = find_extremes(
                base,
                size=SIZES[level],
                workers=min(2, os.cpu_count() or 1) if workers is None else checked_workers(workers),
                progress=lambda what, done, number: shown.show(
                    f"{what}: {done} of {number} points", done=done, total=number
                ),
                kept=None if out is None else out / _KEPT,
            )
        text = json_format.dumps(found.to_dict(), allow_nan=False)
        if stage is not None:
            write_whole(stage / _FILE, text + "\n")
    if out is not None:
        print_message(f"written to {out}")
    if json:
        print(text)
    else:
        print_rows(found.rows(), headline=False)
    return _BROKEN if found.broken() else _DONE


def base_of(scene: Scene) -> Base:
    """Take a scene as the one to vary.

    Raises: SceneError: its chamber is imported.
    """
    if scene.disc.geometry is not None:
        fault = Fault(
            file=scene.file,
            table="disc",
            key="mesh",
            value=toml_text(scene.disc.geometry.file),
            problem="the study takes the dimensions of a sector between plates to their extremes",
            allowed="a scene that gives the dimensions of its chambers",
        )
        raise SceneError([fault])
    return Base(document=document_of(scene), file=scene.source)
