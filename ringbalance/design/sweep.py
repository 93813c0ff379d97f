"""Sweep: a row of results for every point of a plan, without runs and over random devices."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from ringbalance.controller.balancer import balancer_of
from ringbalance.design.axes import Plan, Point, SweepAxis, unit_of_path
from ringbalance.design.sensitivity import MIN_ROWS, first_order, total_order
from ringbalance.design.static import EMPTY, Record, content_of, row_reach, static_rows
from ringbalance.design.store import Store
from ringbalance.design.work import Done, Progress, answers, tasks_of
from ringbalance.results.numbers import format_given, percent
from ringbalance.results.requirements import MET, Proportion
from ringbalance.results.result import Result, Rows, Table, csv_text, extra
from ringbalance.results.rows import Finding, Quantity, Value, around, series
from ringbalance.scene.describe import setting_text
from ringbalance.scene.faults import COMMAND_LINE, Fault, SceneError
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.origins import SceneFile, summary_text
from ringbalance.scene.platform.display import LOG
from ringbalance.scene.registry import registered

_POINTS_PER_BATCH: Final = {True: 256, False: 1024}
"""Number of points in one batch, with intervals and without; constant, since the last bits of the results may
depend on the composition of a batch.
"""
_EDGE_FRACTION: Final = 0.02
"""Distance, as a fraction of the varied range, below which a value counts as at the end."""
STORE: Final = "store"
"""Name of the folder with stored results, within the folder of a sweep."""
_MOST_NAMED: Final = 6
"""Rows that a sentence names, at most."""
_RUN_COLUMNS: Final = {
    "devices": ("devices", ""),
    "fraction": ("fraction", "1"),
    "low": ("fraction low", "1"),
    "high": ("fraction high", "1"),
    "settling_time": ("settling_time", "s"),
    "settling_time_high": ("settling_time high", "s"),
}
"""Columns of runs: name and SI unit by key of `run_row`."""


Shares = dict[str, dict[str, tuple[float, float]]]
"""Share of a result's variance and its half-width (95 %), by result and by axis; an axis is represented by
its first key or the column of its names.
"""


class SweepColumn(NamedTuple):
    """Column of the table of a sweep."""

    name: str
    unit: str
    """SI unit; empty for texts and row numbers."""
    values: list[Any]
    """Values by point; None where not known."""

    @property
    def head(self) -> str:
        """Name with SI unit, such as "velocity [m/s]"."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def array(self) -> Any:
        """Values as an array: numbers with NaN for unknown values, or texts."""
        return _array(self.values)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Sweep(Result):
    """A row for every point.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> table = rb.sweep(scene, {"tube.bore": [1e-3, 1.5e-3]})
        >>> table.point_scene(table.best).tube.bore
        0.001
        >>> columns = table.columns()
        >>> list(columns)[:4]
        ['row', 'tube.bore [m]', 'lambda [m]', 'lambda input half-width [m]']
        >>> [f"{velocity:.3g}" for velocity in columns["velocity [m/s]"]]
        ['13', '14.9']
        >>> table.to_csv().splitlines()[0][:29]
        'row,tube.bore [m],lambda [m],'
        >>> [file.name for file in table.plot("figures")][:3]
        ['sweep-reach.svg', 'sweep-velocity.svg', 'sweep-loop-factor.svg']
    """

    scene: SceneFile
    plan: Plan
    points: tuple[Point, ...]
    """Changed values of each point, SI or text, by path."""
    static: tuple[Record, ...]
    """Rows without runs, as `static_rows` returns them."""
    driven: tuple[Mapping[str, Any], ...]
    """Rows of runs, as `run_row` returns them."""
    runs: int
    """Largest number of devices for each point; 0: no runs."""
    errors: tuple[Record, ...]
    """Errors of the array core by quantity, see `trade.left_out`; empty without a check."""
    designs_per_second: Mapping[str, float]
    """Points computed per second of wall time, for "static" and "runs"."""
    resumed: Mapping[str, int]
    """Number of points with results stored by an earlier run, for "static" and "runs"."""

    def __repr__(self) -> str:
        """Title and all findings, as the command prints them."""
        rows = self.rows()
        return summary_text([rows.title, *(each.text for each in rows.findings)])

    @cached_property
    def verdicts(self) -> tuple[str, ...]:
        """Verdict on each point by its runs, else the status of its static row."""
        pairs = zip(self.static, self.driven, strict=True)
        return tuple(run["verdict"] if self.runs and row["sha256"] else row["status"] for row, run in pairs)

    @cached_property
    def feasible(self) -> tuple[bool, ...]:
        """True for each point that meets the requirements of the scene or, without runs, has a flow."""
        return tuple(verdict == (MET if self.runs else "ok") for verdict in self.verdicts)

    @property
    def _flows(self) -> bool:
        """True if a static row shows whether liquid flows."""
        return scene_kind(self.scene.balancer).arrays

    @cached_property
    def best(self) -> int | None:
        """Row of the feasible point that settles first or, without runs, cancels the largest unbalance."""
        if self.runs:
            ranked = [(each["settling_time"], i) for i, each in enumerate(self.driven)]
        else:
            # Reach decides between rows with a flow; other balancers are not judged without runs.
            ranked = [(row_reach(row), i) for i, row in enumerate(self.static) if self._flows]
            ranked = [(None if value is None else -value, i) for value, i in ranked]
        return min(((v, i) for v, i in ranked if v is not None and self.feasible[i]), default=(0, None))[1]

    @property
    def best_or_nearest(self) -> int | None:
        """Best row, or the nearest if none is feasible."""
        return self.nearest if self.best is None else self.best

    @cached_property
    def nearest(self) -> int | None:
        """Row of the point that serves most devices if runs show none feasible; None: none serves any."""
        ranked = [(run["fraction"] or 0.0, -i) for i, run in enumerate(self.driven)]
        fraction, negative_row = max(ranked, default=(0.0, 0))
        return -negative_row if self.runs and self.best is None and fraction > 0 else None

    def point_scene(self, row: int) -> SceneFile:
        """Scene of a row. Raises: SceneError: a refused row, or no such row."""
        check_rows([row], len(self.points), file="point_scene", key="row")
        return self.scene.with_values(self.points[row])

    def columns(self) -> dict[str, list[Any]]:
        """Table, one list for each column, by name with SI unit such as "velocity [m/s]".

        In this order: `row`; the changed keys by path, for a list with names after the column of names, such
        as "gas.name"; results without runs, each with its half-width (95 %; of a liquid ring by the uncertain
        inputs alone; only with `intervals`); with runs `devices`, `fraction` with its bounds, and
        `settling_time` with its upper bound; `status`, `verdict`, `finding` (reason why a point has no
        result) and `scene sha256`. None for unknown values.
        """
        return {column.head: column.values for column in self.fields()}

    def fields(self) -> list[SweepColumn]:
        """Columns of the table, in the order of `columns`."""
        columns = [SweepColumn("row", "", list(range(len(self.points))))]
        for axis in self.plan.axes:
            if axis.names:
                columns.append(SweepColumn(axis.head, "", [axis.name_of(point) for point in self.points]))
            for path in axis.paths:
                values = [_cell(point.get(path)) for point in self.points]
                columns.append(SweepColumn(path, unit_of_path(self.scene, path), values))
        units = {name: unit for row in self.static for name, unit in row["units"].items()}
        for name, unit in units.items():
            pairs = [row["values"].get(name, (None, None)) for row in self.static]
            columns.append(SweepColumn(name, unit, [value for value, _ in pairs]))
            if any(width is not None for _, width in pairs):
                half_width = "input half-width" if self._flows else "half-width"
                columns.append(SweepColumn(f"{name} {half_width}", unit, [width for _, width in pairs]))
        for key, (name, unit) in _RUN_COLUMNS.items() if self.runs else ():
            columns.append(SweepColumn(name, unit, [run[key] for run in self.driven]))
        return [
            *columns,
            SweepColumn("status", "", [row["status"] for row in self.static]),
            SweepColumn("verdict", "", list(self.verdicts)),
            SweepColumn("finding", "", self.failures),
            SweepColumn("scene sha256", "", [row["sha256"] for row in self.static]),
        ]

    @property
    def failures(self) -> list[str]:
        """Reason why each point has no result; empty if it has one."""
        pairs = zip(self.static, self.driven, strict=True)
        return [
            finding["values"]["text"] if (finding := row["finding"] or run["finding"]) else ""
            for row, run in pairs
        ]

    def to_csv(self) -> str:
        """`columns` as comma-separated values, as `ringbalance sweep` writes table.csv; an empty cell is an
        unknown value.
        """
        return csv_text(self.columns())

    def to_pandas(self) -> Any:
        """`columns` as a DataFrame. Raises: ModuleNotFoundError: without pandas."""
        return extra("pandas", "pandas_frame")(self.columns())

    def to_xarray(self) -> Any:
        """`columns` as a Dataset over the axes of a grid or the rows of a sample, with units by the CF
        conventions.

        Runs of drawn devices keep no histories; `rb.simulate(table.point_scene(row)).to_xarray()` has those
        of one run.
        Raises: ModuleNotFoundError: without xarray.
        """
        grids = self.grid()
        names, shape = list(grids), tuple(map(len, grids.values()))
        array, dataset = extra("xarray", "xarray_array"), extra("xarray", "xarray_dataset")
        fields = {column.name: column for column in self.fields()}
        units = {name: {"units": column.unit} if column.unit else {} for name, column in fields.items()}
        coords = {name: (name, _array(values), units[name]) for name, values in grids.items()}
        variables = {
            name: array(column.array.reshape(shape), dims=names, attrs=units[name])
            for name, column in fields.items()
            if name not in names
        }
        source = {"title": self.scene.name, "source": f"ringbalance sweep of {self.scene.source}"}
        return dataset(variables, coords=coords, attrs=source | {"scene_sha256": self.scene.sha256})

    def sensitivity(self, *, total: bool = False) -> Shares:
        """Share of the variance of each result that each axis explains, and its half-width (95 %).

        First-order Sobol indices by a cosine series, see `first_order`. For samples; empty for a grid, and
        for results with too few points, one value, or a variance that a few points carry.
        Shares below zero, or with a sum above 1, are noise of the sample: an interval that contains zero
        shows no influence; more points narrow it.
        Args: `total`: True for total Sobol indices, by a polynomial, in place of these: they include the
            interactions of an axis with others, see `total_order`.
        """
        changed = {*self.plan.paths, *(axis.head for axis in self.plan.axes)}
        names = [column.name for column in self.fields() if column.name not in changed]
        return self._shares(names, total=total)

    @property
    def main_result(self) -> str:
        """Column of the result that says how well a point serves."""
        return "fraction" if self.runs else "reach"

    @cached_property
    def _main_shares(self) -> Shares:
        return self._shares([self.main_result])

    def _shares(self, names: Sequence[str], *, total: bool = False) -> Shares:
        if not self.plan.sample:
            return {}
        columns = {column.name: column.array for column in self.fields()}
        numbers = {name: each for name, each in columns.items() if each.dtype == np.float64}
        for axis in self.plan.axes:
            if axis.names:
                numbers[axis.head] = np.array([axis.names.index(each) for each in columns[axis.head]], float)
        heads = [axis.head for axis in self.plan.axes if axis.head in numbers]
        shares_by_name = {}
        for name in names if heads else ():
            if name not in numbers:
                continue
            complete = np.isfinite(np.array([numbers[each] for each in (name, *heads)])).all(axis=0)
            if complete.any():
                inputs = np.array([numbers[head][complete] for head in heads]).T
                shares, widths = (total_order if total else first_order)(inputs, numbers[name][complete])
                if np.isfinite(shares).all():
                    pairs = zip(shares.tolist(), widths.tolist(), strict=True)
                    shares_by_name[name] = dict(zip(heads, pairs, strict=True))
        return shares_by_name

    def grid(self) -> dict[str, list[Any]]:
        """Values of each axis of a grid, the last fastest: names of its rows, else values of its first key;
        for a sample, row numbers as "row"."""
        if self.plan.sample:
            return {"row": list(range(len(self.points)))}
        return {
            axis.head: list(axis.names) or [_cell(point[axis.head]) for point in axis.grid()]
            for axis in self.plan.axes
        }

    def plot(self, path: str | PathLike[str] | None = None) -> Any:
        """Draw the map or curves of the sweep: values, what is not feasible, the best.

        Args: `path`: folder for two SVG files per figure, 190 mm and 85 mm wide; None: no files.
        Returns: Files, or without a folder figures that a notebook shows; `svg()` gives them as text.
        Raises: OSError: a file cannot be written.
        """
        if path is None:
            return super().plot()
        return registered("function", "sweep_figures")(self, Path(path))

    def to_dict(self) -> Record:
        """Summary as `ringbalance sweep --json` prints it; the table is `columns`."""
        scene, best, nearest = self.scene, self.best, self.nearest
        return {
            "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
            "balancer": scene.balancer,
            "keys": [{"path": path, "unit": unit_of_path(scene, path)} for path in self.plan.paths],
            "sample": self.plan.sample,
            "points": len(self.points),
            "runs": self.runs,
            "verdicts": dict(Counter(self.verdicts)),
            "best": None if best is None else self._row_document(best),
            "nearest": None if nearest is None else self._row_document(nearest),
            "left_out": list(self.errors),
            "sensitivity": self._main_shares,
            "times": dict(self.designs_per_second),
            "resumed": dict(self.resumed),
            **self.rows().document(),
        }

    def rows(self) -> Rows:
        """Number of points that meet the requirements, the best of them, and errors of the array core."""
        quantities = [
            Quantity(
                key=f"{name}_designs_per_second",
                name=f"designs, {name}",
                value=rate,
                unit="designs a second",
                digits=3,
            )
            for name, rate in self.designs_per_second.items()
        ]
        return Rows(
            title=f"Sweep of {self.scene.name} ({self.scene.source})",
            quantities=tuple(quantities),
            findings=tuple(self._findings()),
            tables=tuple(self._tables()),
        )

    def _findings(self) -> Iterator[Finding]:
        count, total, best = sum(self.feasible), len(self.points), self.best
        code = "sweep_met" if self.runs else "sweep_flows" if self._flows else "sweep_not_judged"
        yield Finding(code=code, values={"count": count, "total": total, "runs": self.runs})
        for what, stored in self.resumed.items():
            yield Finding(code="sweep_resumed", values={"count": stored, "what": what})
        if best is not None:
            by = "settles first" if self.runs else "cancels most in any direction, nothing was run"
            values: dict[str, Value] = {"row": best, "by": by, "changes": self._change_text(best)}
            yield Finding(code="sweep_best", values=values)
            yield from self._alike(best)
            # Keys with a value at an end of their varied range.
            for path in (path for axis in self.plan.axes if not axis.names for path in axis.paths):
                numbers = [value for point in self.points if isinstance(value := point.get(path), float)]
                low, high = min(numbers, default=0.0), max(numbers, default=0.0)
                value = self.points[best].get(path)
                for end in (low, high):
                    near = isinstance(value, float) and abs(value - end) <= _EDGE_FRACTION * (high - low)
                    if low < high and near:
                        text = setting_text(path, end)
                        yield Finding(code="sweep_edge", values={"path": path, "end": text})
        if (nearest := self.nearest) is not None:
            fraction = self.driven[nearest]["fraction"]
            values = {"row": nearest, "changes": self._change_text(nearest), "fraction": fraction}
            yield Finding(code="sweep_nearest", values=values)
            yield from self._alike(nearest)
        if failed := [text for text in self.failures if text]:
            yield Finding(code="sweep_refused", values={"count": len(failed), "text": failed[0]})
        tolerance = float(getattr(self.scene, "tolerance", math.inf))
        for each in self.errors:
            if each["error"] > tolerance:
                yield Finding(code="sweep_too_coarse", values={**each, "tolerance": tolerance})
        if self.errors:
            worst = max(self.errors, key=lambda each: float(each["error"]))
            models = series([f"{each['quantity']} {percent(each['uncertainty'])}" for each in self.errors])
            yield Finding(code="sweep_left_out", values={**worst, "models": models})
        widths = (width for row in self.static for _, width in row["values"].values())
        if self._flows and any(width is not None for width in widths):
            yield Finding(code="sweep_intervals")
        if self.plan.sample and len(self.points) >= MIN_ROWS and not self._main_shares:
            yield Finding(code="sweep_no_shares", values={"name": self.main_result})

    def _alike(self, row: int) -> Iterator[Finding]:
        """Finding that drawn devices do not tell other rows from the best or the nearest one.

        Without runs none: the intervals are by inputs that all rows share, and their order is known better.
        """
        chosen, others = self.driven[row], [i for i in range(len(self.driven)) if i != row]
        if self.best is None:
            what = "fraction"
            like = [i for i in others if (self.driven[i]["high"] or 0.0) >= chosen["fraction"]]
        else:
            what, last = "settling time", chosen["settling_time_high"] or math.inf
            times = {i: self.driven[i]["settling_time"] for i in others if self.feasible[i]}
            like = [i for i, time in times.items() if time is not None and time <= last]
        if self.runs and like:
            rows = [f"row {i}" for i in like[:_MOST_NAMED]]
            rows += [f"{len(like) - _MOST_NAMED} more"] if len(like) > _MOST_NAMED else []
            yield Finding(code="sweep_alike", values={"row": row, "others": rows, "what": what})

    def _change_text(self, row: int) -> str:
        return ", ".join(self.axis_text(axis, row) for axis in self.plan.axes)

    def axis_text(self, axis: SweepAxis, row: int) -> str:
        """Value of an axis in a row: name of the alternative if it has one, else keys with values."""
        point = self.points[row]
        if axis.names:
            return f"{axis.head} = {axis.name_of(point)}"
        return ", ".join(f"{path} = {setting_text(path, point.get(path))}" for path in axis.paths)

    def _row_document(self, row: int) -> Record:
        point = self.points[row]
        names = {axis.head: axis.name_of(point) for axis in self.plan.axes if axis.names}
        return {"row": row, "changes": dict(point), "names": names}

    def _tables(self) -> Iterator[Table]:
        counts, row = Counter(self.verdicts), self.best_or_nearest
        yield Table(heads=("verdict", "points"), rows=[(name, str(n)) for name, n in counts.most_common()])
        if row is not None:
            static, run = self.static[row], self.driven[row]
            cells = []
            if self.runs:
                cells.append(("devices", str(run["devices"])))
                for key in ("fraction", "low", "high", "settling_time"):
                    name, unit = _RUN_COLUMNS[key]
                    cells.append((name, format_given(run[key], unit, digits=3)))
            for name, (value, width) in static["values"].items():
                if value is not None:
                    low, high = around(value, width, stated=bool(self.scene.uncertainty))
                    unit = static["units"][name]
                    quantity = Quantity(key=name, name=name, value=value, unit=unit, lower=low, upper=high)
                    cells.append((name, quantity.text))
            what = "Nearest" if self.best is None else "Best"
            yield Table(caption=f"{what}: row {row}", heads=("quantity", "value"), rows=cells)
        for name, shares in self._main_shares.items():
            rows = [(path, percent(share), percent(width)) for path, (share, width) in shares.items()]
            heads = ("key", "share of its variance", "half-width, 95 %")
            yield Table(caption=f"What decides {name.replace('_', ' ')}", heads=heads, rows=rows)
        if self.errors:
            rows = [
                (each["quantity"], percent(each["error"]), percent(each["uncertainty"]))
                for each in self.errors
            ]
            heads = ("quantity", "rows err by at most", "the models themselves")
            yield Table(caption="Beside a calibration of some rows", heads=heads, rows=rows)


def check_rows(rows: Sequence[int], count: int, *, file: str = COMMAND_LINE, key: str = "--write") -> None:
    """Check row numbers against the length of a table. Raises: SceneError: no such row."""
    for row in rows:
        if not 0 <= row < count:
            allowed = f"0 to {count - 1}"
            fault = Fault(file=file, key=key, value=str(row), problem="no such row", allowed=allowed)
            raise SceneError([fault])


def _cell(value: Any) -> Any:
    """Value of a key in a table; a list as text, SI."""
    return str([*value]) if isinstance(value, list | tuple) else value


def _array(values: Sequence[Any]) -> Any:
    if all(value is None or isinstance(value, int | float) for value in values):
        return np.array([math.nan if value is None else value for value in values])
    return np.array(values, dtype=object)


def run_sweep(
    scene: SceneFile,
    plan: Plan,
    *,
    runs: int = 0,
    intervals: bool = True,
    check: int = 0,
    store: Path | None = None,
    executor: Executor | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> Sweep:
    """Compute every point of a plan; see `sweep`."""
    points = plan.points()
    required = balancer_of(scene).required_fraction() if runs else 0.0
    if runs < (least := Proportion.least_met(required)):
        values: dict[str, Value] = {"runs": runs, "required": required, "least": least}
        LOG.warning("%s", Finding(code="sweep_never_met", values=values).text)
    rates: dict[str, float] = {}
    resumed: dict[str, int] = {}

    def report(done: Done) -> None:
        if done.computed:
            rates[done.what] = done.rate
        elif done.points:
            resumed[done.what] = done.points
        if progress is not None:
            progress(done)

    deal = partial(answers, store=Store(folder=store) if store else None, progress=report)
    deal_out = partial(deal, executor=executor, workers=workers)
    content, size = content_of(scene), _POINTS_PER_BATCH[intervals]
    batches = [points[start : start + size] for start in range(0, len(points), size)]
    calls = [partial(static_rows, scene, each, intervals=intervals) for each in batches]
    static = [row for rows in deal_out("static", tasks_of(content, calls)) for row in rows]
    driven: list[Mapping[str, Any]] = [dict(EMPTY) for _ in points]
    accepted = [i for i, row in enumerate(static) if row["sha256"]] if runs else []
    if accepted:
        run_row = registered("function", "run_row")
        calls = [partial(run_row, scene, points[i], runs=runs) for i in accepted]
        for i, row in zip(accepted, deal_out("runs", tasks_of(content, calls)), strict=True):
            driven[i] = row
    deal_in_process = partial(deal, executor=None)
    # Imported only for a check, since it loads the meshes.
    left_out = registered("function", "left_out") if check else None
    errors = left_out(scene, points, static, check, deal_in_process) if left_out else []
    return Sweep(
        scene=scene,
        plan=plan,
        points=points,
        static=tuple(static),
        driven=tuple(driven),
        runs=runs,
        errors=tuple(errors),
        designs_per_second=rates,
        resumed=resumed,
    )
