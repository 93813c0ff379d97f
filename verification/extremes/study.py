"""A scene at its extremes: every axis from end to end, and a designed set over all of them together.

The command `ringbalance extremes` prints the study.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.design.static import content_of
from ringbalance.design.store import Store
from ringbalance.design.work import answers, tasks_of
from ringbalance.results.numbers import number
from ringbalance.results.result import Cells, Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.toml import toml_text
from ringbalance.verification.evidence import Level
from ringbalance.verification.extremes.axes import AXES, InputAxis, Point, designed_set
from ringbalance.verification.extremes.point import Ending, PointJudgement, judged

Progress = Callable[[str, int, int], None]
"""Called with what is being done, the points done of it and their number."""
Record = dict[str, Any]

_FILE: Final = "extremes.json"
_STORE: Final = "store"
"""Folder of kept judgements in that of a study."""
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
class AxisSweep:
    """One axis from end to end: even steps, and closer ones where the ending changes."""

    axis: InputAxis
    shares: FloatArray
    """Fractions of the way along the axis, ascending, shape (n,)."""
    judgements: tuple[PointJudgement, ...]

    @property
    def values(self) -> list[float]:
        """In the axis' unit."""
        return [float(self.axis.at(share)) for share in self.shares]

    @property
    def points(self) -> list[Point]:
        """Of each judgement."""
        return [{self.axis.name: value} for value in self.values]

    def middles(self, fineness: float) -> list[float]:
        """Fractions half-way between neighbours that end differently, further apart than that."""
        places, ends = self.shares.tolist(), list(map(_outcome, self.judgements))
        return [
            (places[i] + places[i + 1]) / 2
            for i in range(len(ends) - 1)
            if ends[i] != ends[i + 1] and places[i + 1] - places[i] > fineness
        ]

    def with_more(self, shares: Sequence[float], judgements: Sequence[PointJudgement]) -> AxisSweep:
        """The sweep with further places."""
        places, found = np.append(self.shares, shares), (*self.judgements, *judgements)
        order = np.argsort(places)
        return AxisSweep(axis=self.axis, shares=places[order], judgements=tuple(found[i] for i in order))

    def spans(self) -> list[Record]:
        """The stretches along which points end alike, from one end of the axis to the other.

        Each with its first and last value in the axis' unit, how its points and their loops end, and what the
        program says there, at the end towards the nearest answer.
        """
        values, spans = self.values, []
        for _, group in groupby(range(len(values)), key=lambda i: _outcome(self.judgements[i])):
            start, *rest = group
            last = rest[-1] if rest else start
            said = self.judgements[last if start == 0 else start]
            spans.append(
                {
                    "low": values[start],
                    "high": values[last],
                    "ending": str(said.ending),
                    "loop": said.loop,
                    "text": said.text,
                }
            )
        return spans

    def to_dict(self) -> Record:
        """The axis with all its judgements, and what the program says past either end of its answers."""
        axis, values = self.axis, self.values
        answered = [value for value, each in zip(values, self.judgements, strict=True) if each.answered]
        beyond = (each.text for each in self.judgements if not each.answered)
        return {
            "axis": axis.name,
            "title": axis.title,
            "unit": axis.unit,
            "tried": [axis.low, axis.high],
            "answered": [answered[0], answered[-1]] if answered else None,
            "beyond": list(dict.fromkeys(beyond)),
            "spans": self.spans(),
            "values": values,
            "ending": [str(each.ending) for each in self.judgements],
            "loop": [each.loop for each in self.judgements],
            "residual": [each.residual for each in self.judgements],
        }


def _outcome(judgement: PointJudgement) -> tuple[Ending, str]:
    return judgement.ending, judgement.loop


@dataclass(frozen=True, kw_only=True, repr=False)
class Extremes(Result):
    """Judgements of the designed set, in the order of its points, and of every axis.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> study = rb.extremes(scene)
        >>> study.to_dict()["points"] > 0
        True
    """

    points: tuple[Point, ...]
    judgements: tuple[PointJudgement, ...]
    sweeps: tuple[AxisSweep, ...]

    @property
    def everything(self) -> tuple[PointJudgement, ...]:
        """Judgements of the designed set and the sweeps."""
        return self.judgements + tuple(each for sweep in self.sweeps for each in sweep.judgements)

    def broken(self) -> int:
        """Number of points, of all looked at, at which anything was not as it should be."""
        return sum(bool(each.violations) for each in self.everything)

    def to_dict(self) -> Record:
        """Numbers of points by how they and their loops ended, the worst of them, and every axis."""
        everything = self.everything
        endings = Counter(each.ending for each in everything)
        return {
            "points": len(self.points),
            "judged": len(everything),
            "endings": {str(ending): endings[ending] for ending in Ending},
            "loop_endings": dict(Counter(each.loop for each in everything if each.loop)),
            "worst_residual": max((each.residual for each in everything), default=0.0),
            "worst_error_over_half_width": max((each.worst_ratio for each in everything), default=-1.0),
            "violations": self._violations(),
            "axes": [sweep.to_dict() for sweep in self.sweeps],
        }

    def _violations(self) -> list[Record]:
        points = (*self.points, *(point for sweep in self.sweeps for point in sweep.points))
        return [
            {"point": dict(point), "violations": list(each.violations)}
            for point, each in zip(points, self.everything, strict=True)
            if each.violations
        ][:_MOST_SHOWN]

    def axes_table(self) -> dict[str, list[Any]]:
        """The stretches of all axes as columns."""
        spans = [(sweep.axis, span) for sweep in self.sweeps for span in sweep.spans()]
        keys = {"from": "low", "to": "high", "ending": "ending", "loop": "loop", "said": "text"}
        return {
            "axis": [axis.title for axis, _ in spans],
            "unit": [axis.unit for axis, _ in spans],
            **{name: [span[key] for _, span in spans] for name, key in keys.items()},
        }

    def rows(self) -> Rows:
        """How the points ended, and where along each axis."""
        document = self.to_dict()
        worst = document["worst_error_over_half_width"]
        quantities = (
            ("broken", "points with a violated invariant", float(self.broken()), 6),
            ("worst_residual", "largest residual", document["worst_residual"], 2),
            (
                "worst_error_over_half_width",
                "largest error over its half-width",
                None if worst < 0 else worst,
                2,
            ),
        )
        return Rows(
            title=f"Limits of validity: {document['judged']} points",
            quantities=tuple(
                Quantity(key=key, name=name, value=value, digits=digits)
                for key, name, value, digits in quantities
            ),
            facts=[(ending, str(count)) for ending, count in document["endings"].items() if count],
            findings=tuple(
                Finding(
                    code="invariant_violated",
                    values={
                        "violations": each["violations"],
                        "point": ", ".join(f"{axis} {value:.4g}" for axis, value in each["point"].items()),
                    },
                )
                for each in document["violations"]
            ),
            tables=(
                Table(
                    heads=("input", "stretch", "answer", "loop", "said"), rows=axis_rows(self.axes_table())
                ),
            ),
        )


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
    scene: Scene,
    *,
    size: Size,
    workers: int = 1,
    progress: Progress | None = None,
    folder: Path | None = None,
    mutation: Mapping[str, float] | None = None,
) -> Extremes:
    """Look at a scene's extremes, with the same result for any number of workers.

    Args: `folder`: folder from which an interrupted study resumes. `mutation`: see `judged`.
    Raises: SceneError: its chamber is imported.
    Raises: OSError: the folder cannot be written.
    """
    check_sector(scene)
    content, keywords = content_of(scene), dict(mutation or {})
    store = None if folder is None else Store(folder=folder)

    def judge_all(what: str, points: Sequence[Point]) -> list[PointJudgement]:
        tasks = tasks_of(content, [partial(judged, scene, point, **keywords) for point in points])
        records = answers(
            what,
            tasks,
            store=store,
            executor=None,
            workers=workers,
            progress=progress and (lambda done: progress(done.what, done.points, done.total)),
        )
        return [PointJudgement.of_record(record) for record in records]

    points = designed_set(count=size.points, seed=_SEED)
    return Extremes(
        points=points,
        judgements=tuple(judge_all("designed set", points)),
        sweeps=_sweeps(partial(judge_all, "axes"), size),
    )


def _sweeps(
    judge: Callable[[Sequence[Point]], Sequence[PointJudgement]], size: Size
) -> tuple[AxisSweep, ...]:
    """Every axis alone, in even steps, then halved wherever neighbours end differently.

    Of changes back and forth within a step some may be missed.
    """
    sweeps = [AxisSweep(axis=axis, shares=np.zeros(0), judgements=()) for axis in AXES]
    places = [np.linspace(0, 1, size.sweep).tolist() for _ in AXES]
    while any(places):
        points = [
            {axis.name: float(axis.at(share))}
            for axis, shares in zip(AXES, places, strict=True)
            for share in shares
        ]
        found = iter(judge(points))
        sweeps = [
            sweep.with_more(shares, [next(found) for _ in shares])
            for sweep, shares in zip(sweeps, places, strict=True)
        ]
        places = [sweep.middles(size.fineness) for sweep in sweeps]
    return tuple(sweeps)


def check_sector(scene: Scene) -> None:
    """Raises: SceneError: its chamber is imported."""
    if scene.disc.geometry is None:
        return
    fault = Fault(
        file=scene.file,
        table="disc",
        key="mesh",
        value=toml_text(scene.disc.geometry.file),
        problem="the study takes the dimensions of a sector between plates to their extremes",
        allowed="a scene that gives the dimensions of its chambers",
    )
    raise SceneError([fault])
