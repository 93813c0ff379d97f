"""Speed against accuracy: every model hierarchy with its front, and the models that a tolerance needs."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record, Section, Table, Work
from ringbalance.results.numbers import MISSING, number, percent
from ringbalance.scene.models import Scene
from ringbalance.verification.selection_studies.study import TradeStudy, tolerance_text, trade_study

_LEAST: Final = 1e-9
"""Error at which a model that equals the finest is drawn."""
_MOST_ROWS: Final = 8


def _collect(work: Work) -> Record | None:
    """The trade of the scene, light: without the settling time."""
    return _study(work.scene).document()


@lru_cache(maxsize=4)
def _study(scene: Scene) -> TradeStudy:
    """One measurement serves every report of a scene within a process."""
    return trade_study(scene, level="light")


def _view(found: Record, evidence: Record) -> Record:
    times = (evidence["times"].get("trade") or {}).get("rungs", {})
    numbers = [(n["name"], number(n["value"], digits=3), n["formula"], n["tells"]) for n in found["numbers"]]
    return {
        "tolerance": tolerance_text(found["tolerance"], _error),
        "numbers": Table(
            caption="The scene’s dimensionless numbers, at equal fills.",
            heads=("Number", "Value", "Formula", "What it decides"),
            rows=numbers,
        ),
        "quantities": [_quantity(q, times.get(q["quantity"], [])) for q in found["quantities"] if q["rungs"]],
    }


def _quantity(found: Record, times: list[Record]) -> Record:
    seconds = {entry["name"]: entry["seconds"] for entry in times}
    front = sorted((r for r in found["rungs"] if r["on_front"]), key=lambda r: r["cost_s"])
    models = [
        (
            model["name"],
            MISSING if model["name"] == found["top"] else _error(model["error"]),
            _time(model["cost_s"]),
            _time(seconds.get(model["name"])),
        )
        for model in front[:_MOST_ROWS]
    ]
    *choices, own = found["choices"]
    chosen = [(_error(c["tolerance"]), c["rung"], _error(c["measured"]), _time(c["cost_s"])) for c in choices]
    return {
        "title": _headed(found["title"]),
        "status": "" if found["status"]["code"] == "ok" else found["status"]["text"],
        "front": Table(
            caption=f"The front, cheapest first. Finest model: {found['top']}, known to "
            f"{_error(found['top_uncertainty'])}. Trade-off point: {found['knee']}.",
            heads=("Model", "Error", "Counted cost", "Measured time"),
            rows=models,
            style="",
        ),
        "choices": Table(
            caption="What a tolerance needs, chosen by estimates and checked by the next finer model.",
            heads=("Tolerance", "Models", "Left out, measured", "Counted cost"),
            rows=chosen,
            style="",
        ),
        "own": {"model": own["rung"], "reasons": own["reasons"]},
        "figure": _front_figure(found),
    }


def _headed(title: str) -> str:
    """With a capital, unless it is a symbol."""
    return title if len(title) == 1 else title[0].upper() + title[1:]


def _error(value: float | None) -> str:
    if value is None:
        return MISSING
    return percent(value, digits=2) if value >= 1e-3 else number(value, digits=2)


def _time(value: float | None) -> str:
    if value is None:
        return MISSING
    unit, scale = ("µs", 1e-6) if value < 1e-3 else ("ms", 1e-3) if value < 1 else ("s", 1.0)
    return f"{number(value / scale, digits=2)} {unit}"


def _front_figure(found: Record) -> Drawing:
    """Error against counted cost of every model, with the front and its trade-off point."""
    fidelities = sorted(found["rungs"], key=lambda r: r["cost_s"])
    cost = np.array([r["cost_s"] for r in fidelities])
    error = np.array([max(r["error"], _LEAST) for r in fidelities])
    front = np.array([r["on_front"] for r in fidelities])
    at_knee = np.array([r["name"] == found["knee"] for r in fidelities])

    def paint(axes: Axes) -> None:
        known = found["top_uncertainty"]
        axes.plot(
            cost[~front], error[~front], "o", color=style.MUTED, markersize=3.5, label="beaten by another"
        )
        axes.plot(cost[front], error[front], "o-", color=style.FOUND, markersize=5, label="the front")
        axes.plot(
            cost[at_knee], error[at_knee], "D", color=style.INK, markersize=8, fillstyle="none", label="knee"
        )
        axes.axhline(known, color=style.PAPER, linewidth=1, linestyle=":", label="known to")
        style.logarithmic(axes, "x")
        style.logarithmic(axes, "y")
        axes.set_xlim(cost.min() / 2, cost.max() * 2)
        low = min(error.min(), found["top_uncertainty"])
        axes.set_ylim(low / 3, max(error.max() * 3, 1.0))

    return draw(
        columns=4,
        x="counted cost in s",
        y="error against the top",
        name=f"trade-{found['quantity'].replace('_', '-')}",
        paint=paint,
        height=2.9,
        alt=f"Error of {len(fidelities)} models for {found['title']} against their cost, falling along the "
        "front "
        f"to the finest model; the trade-off point is {found['knee']}.",
        caption=f"{_headed(found['title'])}. The finest model is drawn at 10⁻⁹; dotted: what it "
        "is itself known to.",
    )


SECTION: Final = Section(name="trade", title="Speed against accuracy", collect=_collect, show=_view)
