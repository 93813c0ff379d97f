"""Results of many designs without a run: liquid rings by the array core, other balancers one by one.

An interval (95 %) is that by all uncertain inputs of the scene: each input is changed up and down, and the
effects are added as root of the sum of squares.  It excludes the models' uncertainty, which `calibrate` adds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import balancer_of
from ringbalance.design.axes import Point
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.core import Answers
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.results.numbers import believed
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import FloatArray, finite
from ringbalance.scene.changes import document_of, nameless
from ringbalance.scene.designs import Designs, changes_of, in_batches
from ringbalance.scene.errors import larger, uncertainties
from ringbalance.scene.faults import SceneError
from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.origins import SceneFile

Record = dict[str, Any]

UNITS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "lambda": "m",
        "chamber_volume": "m^3",
        "wall_pressure": "Pa",
        "moment": "kg m",
        "velocity": "m/s",
        "drag_coefficient": "1",
        "stall_pressure": "Pa",
        "residual_fill_ratio": "1",
        "stalled_fill_ratio": "1",
        "usable_moment": "kg m",
        "reach": "kg m",
        "loop_factor": "1",
    }
)
"""SI unit of each result for a liquid ring, in the order of the table."""
_ANSWER_FIELDS: Final = {"lambda": "moment_per_mass"}
"""Field of `Answers` by name of the result, where they differ."""
BLOCKED: Final = "blocked"
REFUSED: Final = "point_refused"
EMPTY: Final[Mapping[str, Any]] = MappingProxyType(
    {
        **dict.fromkeys(("devices", "fraction", "low", "high", "settling_time", "settling_time_high")),
        "verdict": "",
        "ended": {},
        "finding": None,
    }
)
"""Result of `run_row` for a point without runs."""
_LIMIT_SUFFIX: Final = ", at most"
"""Suffix of the name of a quantity that is the limit of a setting."""
BREAKDOWNS: Final = (ValueError, ArithmeticError, RuntimeError)
"""Exceptions besides `SceneError` with which a point may break down."""


def row_reach(row: Record) -> float | None:
    """Unbalance that a design cancels in any direction, kg m, from its static row; None: not known."""
    reach: float | None = row["values"].get("reach", (None,))[0]
    return reach


def refusal(error: Exception) -> Record:
    """Finding on a failed point, as a document."""
    text = str(error.faults[0]) if isinstance(error, SceneError) else f"{type(error).__name__}: {error}"
    return Finding(code=REFUSED, values={"text": text}).document()


def static_rows(scene: SceneFile, points: Sequence[Point], *, intervals: bool = True) -> list[Record]:
    """Rows of points without a run, plain data.

    Args: `intervals`: True adds half-widths by uncertain inputs: 2 m + 1 designs a point for m inputs.
    Returns: For each point `sha256` of its scene (empty if refused), `values` with pairs of value and
        half-width (95 %, by the inputs; None: not known) by name, `units`, `status` and `finding`.
    """
    rows: list[Record] = []
    scenes: list[Scene] = []
    by_core = scene_kind(scene.balancer).arrays
    for point in points:
        try:
            if not by_core:
                rows.append(_row_without_core(scene.with_values(point)))
                continue
            design, digest = nameless(liquid_ring_scene(scene), point)
            check_ring(design)
            scenes.append(design)
            rows.append({"sha256": digest})
        except (SceneError, *BREAKDOWNS) as error:
            rows.append(_failed(error))
    answers = iter(_answered(scenes, intervals))
    return [row if "status" in row else {**row, **next(answers)} for row in rows]


def _failed(error: Exception) -> Record:
    return {"sha256": "", "values": {}, "units": {}, "status": REFUSED, "finding": refusal(error)}


def _answered(scenes: Sequence[Scene], intervals: bool) -> list[Record]:
    """Rows of liquid rings, computed together; one by one if that breaks down."""
    if not scenes:
        return []
    try:
        table = in_batches(scenes, partial(core_table, intervals=intervals))
    except BREAKDOWNS as error:
        if len(scenes) == 1:
            return [_failed(error)]
        return [row for each in scenes for row in _answered([each], intervals)]
    return [_row(column) for column in table.T]


def _row(column: FloatArray) -> Record:
    regime, *numbers = column.tolist()
    triples = zip(UNITS, numbers[: len(UNITS)], numbers[len(UNITS) :], strict=True)
    values = {
        name: [finite(value), finite(believed(value, width, stated=True) or 0.0)]
        for name, value, width in triples
    }
    status = BLOCKED if int(regime) == Regime.BLOCKED else "ok"
    return {"values": values, "units": dict(UNITS), "status": status, "finding": None}


def core_table(designs: Designs, *, intervals: bool) -> FloatArray:
    """Regimes, values and half-widths (95 %, by the inputs), shape (1 + 2 k, n); NaN: not known."""
    if not intervals:
        values = _values(designs)
        return np.concatenate([values, np.full(values[1:].shape, np.nan)])
    function = partial(_values, near=TubeFlow.of(designs))
    errors = uncertainties(designs.scene, models=False)
    values, changes = changes_of(designs.scene, function, errors, each=designs.size)
    variance = np.sum(np.square(larger(changes)), axis=0)
    return np.concatenate([values, np.where(np.isnan(values), np.nan, np.sqrt(variance))[1:]])


def _values(designs: Designs, *, near: TubeFlow | None = None) -> FloatArray:
    """Regime and the results in `UNITS`, shape (1 + k, n). Args: `near`: see `Answers.of`."""
    answers = Answers.of(designs, near=near)
    return np.array([answers.regime, *(getattr(answers, _ANSWER_FIELDS.get(name, name)) for name in UNITS)])


def _row_without_core(scene: SceneFile) -> Record:
    """Row of a point whose balancer has no array core, from the balancer's quantities without a run."""
    values: dict[str, list[float | None]] = {}
    units: dict[str, str] = {}
    for each in balancer_of(scene).quantities():
        if each.value is None:
            continue
        # The suffix distinguishes the limit of a setting from the setting.
        name = each.key + _LIMIT_SUFFIX * each.name.endswith(_LIMIT_SUFFIX)
        width = None
        if each.lower is not None and each.upper is not None and each.value:
            width = max(abs(each.lower - each.value), abs(each.upper - each.value))
        values[name], units[name] = [finite(each.value), width], each.unit
    return {"sha256": scene.sha256, "values": values, "units": units, "status": "ok", "finding": None}


def content_of(scene: SceneFile) -> Record:
    """Content of a scene that determines its results, plain data: its document and the digest of its mesh."""
    return {"document": dict(document_of(scene)), "mesh": scene.mesh_digest}
