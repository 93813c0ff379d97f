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
"""Function of the name of the current step, the number of its points done, and their total."""
Record = dict[str, Any]

_SEED: Final = 1
_MAX_VIOLATIONS: Final = 20


@dataclass(frozen=True, kw_only=True)
class Size:
    """Extent of a study."""

    points: int
    """Points of the designed set."""
    sweep: int
    """Number of first values on each axis."""
    fineness: float
    """Fraction of an axis within which a change of the ending is located."""


SIZES: Final[Mapping[Level, Size]] = {
    "light": Size(points=40, sweep=7, fineness=0.03),
    "heavy": Size(points=5000, sweep=15, fineness=1e-3),
}


@dataclass(frozen=True, kw_only=True)
class AxisSweep:
    """One axis from end to end, in even steps, with smaller ones where the ending changes."""

    axis: InputAxis
    shares: FloatArray
    """Fractions of the way along the axis, ascending, shape (n,)."""
    judgements: tuple[PointJudgement, ...]

    @property
    def values(self) -> list[float]:
        """Values in the unit of the axis."""
        return [float(self.axis.at(share)) for share in self.shares]

    @property
    def points(self) -> list[Point]:
        """Point of each judgement."""
        return [{self.axis.name: value} for value in self.values]

    def middles(self, fineness: float) -> list[float]:
        """Fractions half-way between neighbours with different endings, further apart than `fineness`."""
        shares, ends = self.shares.tolist(), [(each.ending, each.loop) for each in self.judgements]
        return [
            (shares[i] + shares[i + 1]) / 2
            for i in range(len(ends) - 1)
            if ends[i] != ends[i + 1] and shares[i + 1] - shares[i] > fineness
        ]

    def with_more(self, shares: Sequence[float], judgements: Sequence[PointJudgement]) -> AxisSweep:
        """The sweep with further values."""
        all_shares, everything = np.append(self.shares, shares), (*self.judgements, *judgements)
        order = np.argsort(all_shares)
        return AxisSweep(
            axis=self.axis, shares=all_shares[order], judgements=tuple(everything[i] for i in order)
        )

    def spans(self) -> list[Record]:
        """Intervals with one ending, from one end of the axis to the other.

        Each has its first and last value in the unit of the axis, the ending of its points and loops, and a
        message: of the first interval that of its last point, of the others that of their first.
        """
        values, spans = self.values, []
        ends = [(each.ending, each.loop) for each in self.judgements]
        for _, group in groupby(range(len(values)), key=ends.__getitem__):
            start, *rest = group
            last = rest[-1] if rest else start
            message = self.judgements[last if start == 0 else start]
            spans.append(
                {
                    "low": values[start],
                    "high": values[last],
                    "ending": str(message.ending),
                    "loop": message.loop,
                    "text": message.text,
                }
            )
        return spans

    def to_dict(self) -> Record:
        """The axis with all its judgements, the ends of its solved range, and messages of unsolved points."""
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
        """Number of points, of the designed set and the sweeps, that count as broken."""
        return sum(bool(each.violations) for each in self.everything)

    def to_dict(self) -> Record:
        """Numbers of points by how they and their loops ended, the worst of them, and every axis."""
        everything = self.everything
        endings = Counter(each.ending for each in everything)
        points = (*self.points, *(point for sweep in self.sweeps for point in sweep.points))
        violations = [
            {"point": dict(point), "violations": list(each.violations)}
            for point, each in zip(points, everything, strict=True)
            if each.violations
        ]
        return {
            "points": len(self.points),
            "judged": len(everything),
            "endings": {str(ending): endings[ending] for ending in Ending},
            "loop_endings": dict(Counter(each.loop for each in everything if each.loop)),
            "worst_residual": max((each.residual for each in everything), default=0.0),
            "worst_error_over_half_width": max((each.worst_ratio for each in everything), default=-1.0),
            "violations": violations[:_MAX_VIOLATIONS],
            "axes": [sweep.to_dict() for sweep in self.sweeps],
        }

    def axes_table(self) -> dict[str, list[Any]]:
        """Intervals of all axes as columns."""
        spans = [(sweep.axis, span) for sweep in self.sweeps for span in sweep.spans()]
        keys = {"from": "low", "to": "high", "ending": "ending", "loop": "loop", "said": "text"}
        return {
            "axis": [axis.title for axis, _ in spans],
            "unit": [axis.unit for axis, _ in spans],
            **{name: [span[key] for _, span in spans] for name, key in keys.items()},
        }

    def rows(self) -> Rows:
        """Endings of the points, and their intervals along each axis."""
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
    """Intervals of every axis: title (in the first row), interval, answer, loop and message."""
    rows: list[Cells] = []
    before = ""
    names = ("axis", "from", "to", "unit", "ending", "loop", "said")
    for title, low, high, unit, ending, loop, message in zip(*(columns[name] for name in names), strict=True):
        first, last = (number(float(end), digits=3) for end in (low, high))
        stretch = first if first == last else f"{first} to {last}"
        rows.append(
            (
                "" if title == before else title,
                stretch if unit == "1" else f"{stretch} {unit.replace('^2', '²')}",
                str(ending).removesuffix(" with a message"),
                str(loop).replace("_", " "),
                # First line of the message, without the name of the scene file, which does not exist.
                str(message).split("\n")[0].split(".toml: ", 1)[-1],
            )
        )
        before = title
    return rows


def find_extremes(
    scene: Scene,
    *,
    size: Size,
    workers: int = 1,
    progress: Progress | None = None,
    folder: Path | None = None,
    mutation: Mapping[str, float] | None = None,
) -> Extremes:
    """Study a scene's extremes, with the same result for any number of workers.

    Every axis is looked at in even steps, then halved wherever neighbours end differently: of changes back
    and forth within a step some may be missed.
    Args: `folder`: stores judgements, so that an interrupted study resumes. `mutation`: see `judged`.
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
    judgements = judge_all("designed set", points)
    sweeps = [AxisSweep(axis=axis, shares=np.zeros(0), judgements=()) for axis in AXES]
    shares = [np.linspace(0, 1, size.sweep).tolist() for _ in AXES]
    while any(shares):
        on_axes = [
            {axis.name: float(axis.at(share))}
            for axis, axis_shares in zip(AXES, shares, strict=True)
            for share in axis_shares
        ]
        new = iter(judge_all("axes", on_axes))
        sweeps = [
            sweep.with_more(axis_shares, [next(new) for _ in axis_shares])
            for sweep, axis_shares in zip(sweeps, shares, strict=True)
        ]
        shares = [sweep.middles(size.fineness) for sweep in sweeps]
    return Extremes(points=points, judgements=tuple(judgements), sweeps=tuple(sweeps))


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
