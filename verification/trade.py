"""Speed against accuracy, measured on a scene: a chamber's totals and the tube's flow, each by every model.

Each model answers the same questions as the finest one; its error is the largest relative difference from
that, to be compared with the uncertainty of the finest one.  `ringbalance trade` prints the study.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from operator import itemgetter
from typing import Any, Final

import numpy as np

from ringbalance.mesh.chamber import default_cells
from ringbalance.physics.results import Status
from ringbalance.reduced_model.calibration import chamber_and_law
from ringbalance.reduced_model.chamber.contributions import chamber_fills, chamber_status
from ringbalance.reduced_model.chamber.element_check import ImportedElements, scene_ring
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.chamber.values import RingValues, paper_closed_forms
from ringbalance.reduced_model.law.flow_law import FlowLaw
from ringbalance.reduced_model.law.making import nominal_law
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.terms import models_used, terms_of
from ringbalance.results.numbers import MISSING, number, percent
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Quantity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import without_fitted
from ringbalance.verification.evidence import Level

Record = dict[str, Any]
Solve = Callable[[], tuple[FloatArray, ...]]
"""Function that returns values at the points of a study, one array per quantity."""

_ENOUGH_CPU_S: Final = 0.2
"""Processor time after which a solve is not repeated, s."""
_MAX_REPEATS: Final = 5
_FLOW_FILLS_OF_MAX: Final = (0.2, 0.4, 0.5, 0.6, 0.8)
"""Fills of the driven chamber over max_fill_ratio."""


@dataclass(frozen=True, kw_only=True, repr=False)
class TradeStudy(Result):
    """Speed against accuracy of one scene.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> study = rb.trade(scene, level="light")
        >>> sorted(study.to_dict()["quantities"][0])[:3]
        ['models', 'points', 'quantity']
    """

    scene: Scene
    quantities: tuple[Record, ...]
    """Quantities by every model, the finest last: name and title, points, half-width of the finest model
    (95 %, relative, without the inputs' part), status; of a model its values at the points, SI, and the
    largest difference from the finest one, relative to that one's largest value."""
    times: Mapping[str, Sequence[Record]]
    """Times of each quantity's models: processor time of all points, s, the least of some tries, and the
    designs that one processor answers in a second."""

    def rows(self) -> Rows:
        """Fastest model of each quantity with an error within the finest one's half-width, and all models."""
        fastest = []
        for quantity in self.quantities:
            name, models = quantity["quantity"], quantity["models"]
            good = {model["model"] for model in models if model["error"] <= quantity["uncertainty"]}
            if not models:
                continue
            times = (each for each in self.times[name] if each["model"] in good)
            best = min(times, key=itemgetter("seconds"))
            fastest.append(
                Quantity(
                    key=f"{name}_designs_per_second",
                    name=f"{quantity['title']}, by {best['model']}",
                    value=best["designs_per_second"],
                    unit="designs a second",
                    digits=2,
                )
            )
        return Rows(
            title=f"Speed against accuracy of {self.scene.name} ({self.scene.source})",
            quantities=tuple(fastest),
            tables=tuple(models_table(each, self.times) for each in self.quantities),
        )

    def to_dict(self) -> Record:
        """Plain numbers and texts; all but `times` is the same on every machine."""
        scene = self.scene
        return {
            "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
            "tolerance": scene.tolerance,
            "terms": [
                {
                    "term": term.name,
                    "group": term.group,
                    "estimated_contribution": term.value,
                    "why": term.reason(),
                }
                for term in terms_of(scene)
            ],
            "models_used": [asdict(used) for used in models_used(scene)],
            "quantities": list(self.quantities),
            "times": dict(self.times),
        }


def models_table(quantity: Record, times: Mapping[str, Sequence[Record]]) -> Table:
    """Table of a quantity's models from records of `TradeStudy.to_dict`; times may be missing."""
    speed = {each["model"]: each["designs_per_second"] for each in times.get(quantity["quantity"], ())}
    models, title = quantity["models"], quantity["title"][0].upper() + quantity["title"][1:]
    rows = [
        (
            model["model"],
            MISSING if model is models[-1] else error_text(model["error"]),
            number(speed.get(model["model"]), digits=2),
        )
        for model in models
    ]
    return Table(
        caption=f"{title}. The last model is the finest, known to {error_text(quantity['uncertainty'])}.",
        heads=("Model", "Error", "Designs a second"),
        rows=rows,
        note="" if quantity["status"]["code"] == "ok" else quantity["status"]["text"],
        style="",
    )


def error_text(value: float | None) -> str:
    """A relative error as text, from 0.1 % on as a percentage."""
    return percent(value, digits=2) if value is None or value >= 1e-3 else number(value, digits=2)


def trade_study(
    scene: Scene, *, level: Level = "heavy", progress: Callable[[str], None] | None = None
) -> TradeStudy:
    """Measure every model of a scene; all but times repeats on every machine.

    Args: `level`: "light" leaves the meshes in three dimensions out. `progress`: called with each title.
    Raises: SceneError: a rotor too slow for the liquid to form a ring.
    """
    check_ring(scene)
    scene, report_progress = without_fitted(scene), progress or (lambda _: None)
    report_progress("chamber")
    chamber, law = chamber_and_law(scene)
    fills = chamber_fills(scene)
    models = _chamber_models(scene, fills, meshes=level == "heavy") if fills.size else {}
    judged = chamber.fill_ratio >= fills.min(initial=1.0)
    half_widths = [
        float(np.max(_relative(curve.uncertainty, curve.value), where=judged, initial=0.0))
        for curve in (chamber.wall_pressure, chamber.moment)
    ]
    measured = _measured(
        models,
        {"wall_pressure": "wall pressure, mean over a turn, Pa", "moment": "moment of a chamber, kg m"},
        fills,
        half_widths=half_widths,
        status=chamber_status(scene),
    )
    report_progress("velocity")
    driven = scene.disc.max_fill_ratio * np.array(_FLOW_FILLS_OF_MAX)
    flow = law.evaluate(fill_ratio=driven, gas_pressure=scene.gas.pressure)

    def velocity(law: Callable[[], FlowLaw]) -> tuple[FloatArray, ...]:
        return (law().evaluate(fill_ratio=driven, gas_pressure=scene.gas.pressure).velocity,)

    constant = replace(scene, tube=replace(scene.tube, drag_coefficient=PAPER_DRAG_COEFFICIENT))
    laws: dict[str, Callable[[], FlowLaw]] = {
        "the paper's law": lambda: paper_law(scene),
        f"k = {PAPER_DRAG_COEFFICIENT:g}, regimes over the crest": lambda: nominal_law(
            constant, gravity=False
        ),
        "correlations and finite-element tables, few nodes": lambda: nominal_law(scene, gravity=False),
        "the same with gravity to all orders": lambda: nominal_law(scene, gravity=True),
        "the same with uncertainties, checked by finite elements": lambda: chamber_and_law(scene)[1],
    }
    measured += _measured(
        {name: partial(velocity, law) for name, law in laws.items()},
        {"velocity": "velocity in the tube, m/s"},
        driven,
        half_widths=[float(np.max(_relative(flow.uncertainty, flow.velocity)))],
        status=Status(),
    )
    quantities, times = zip(*measured, strict=True)
    names = [quantity["quantity"] for quantity in quantities]
    return TradeStudy(scene=scene, quantities=quantities, times=dict(zip(names, times, strict=True)))


def _relative(width: FloatArray, value: FloatArray) -> FloatArray:
    return np.asarray(width / np.where(value == 0, math.inf, np.abs(value)))


def _measured(
    models: dict[str, Solve],
    titles: Mapping[str, str],
    fills: FloatArray,
    *,
    half_widths: Sequence[float],
    status: Status,
) -> list[tuple[Record, list[Record]]]:
    """Solve and time every model, the last being the finest; return each quantity with its models' times.

    Args: `titles`: by quantity, in the order of the values of a solve.
    """
    solutions, times = {}, []
    for model, solve in models.items():
        cpu_times: list[float] = []
        while not cpu_times or (sum(cpu_times) < _ENOUGH_CPU_S and len(cpu_times) < _MAX_REPEATS):
            start = time.process_time()
            solutions[model] = solve()
            cpu_times.append(time.process_time() - start)
        seconds = max(min(cpu_times), 1e-9)
        times.append({"model": model, "seconds": seconds, "designs_per_second": 1 / seconds})
    measured = []
    for index, (name, title) in enumerate(titles.items()):
        values = {model: solution[index] for model, solution in solutions.items()}
        finest = values[next(reversed(values))] if values else np.zeros(0)
        scale = float(np.max(np.abs(finest), initial=0.0)) or 1.0
        record = {
            "quantity": name,
            "title": title,
            "points": [f"fill ratio {x:.3g}" for x in fills],
            "uncertainty": half_widths[index],
            "status": {"code": str(status.code), "text": status.text},
            "models": [
                {
                    "model": model,
                    "values": value.tolist(),
                    "error": float(np.max(np.abs(value - finest))) / scale,
                }
                for model, value in values.items()
            ],
        }
        measured.append((record, times))
    return measured


def _chamber_models(scene: Scene, fills: FloatArray, *, meshes: bool) -> dict[str, Solve]:
    """Models of wall pressure and moment; the finest has the free surface under gravity to all orders."""

    def closed(gravity: bool) -> tuple[FloatArray, ...]:
        ring = RingValues.of(scene, fill_ratio=fills, gravity=gravity)
        return ring.wall_pressure.value, ring.moment.value

    def elements(cells: tuple[int, ...]) -> tuple[FloatArray, ...]:
        meshes_of_three = tuple(tuple(max(1, n // k) for n in cells) for k in (1, 2, 4))
        ring = scene_ring(scene, fill_ratio=fills, gravity=False, cells=meshes_of_three)
        return ring.wall_pressure.value, ring.moment.value

    walls = "closed form" if scene.disc.geometry is None else "integrals over the walls"
    models: dict[str, Solve] = {
        "the paper's formulas": partial(paper_closed_forms, scene, fills),
        walls: partial(closed, False),
    }
    if geometry := scene.disc.geometry:

        def on_its_mesh() -> tuple[FloatArray, ...]:
            totals = ImportedElements.of(scene, geometry, fill_ratio=fills)
            return totals.wall_pressure.value, totals.moment.value

        models |= {"3-D finite elements on its mesh": on_its_mesh} if meshes else {}
    else:
        fine = [default_cells(disc=scene.disc, dimension=dimension) for dimension in (2, 3)]
        coarse = tuple(max(4, n // 2) for n in fine[0])
        for cells in (coarse, *(fine if meshes else fine[:1])):
            named = " x ".join(map(str, cells))
            models[f"{len(cells)}-D finite elements, {named} cells"] = partial(elements, cells)
    return models | {f"{walls}, gravity to all orders": partial(closed, True)}
