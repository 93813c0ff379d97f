"""Figures of a result for `plot()`, in the report's style."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from matplotlib.axes import Axes

from ringbalance.design.racing import DEVICES
from ringbalance.identification.documents import against_fit
from ringbalance.reduced_model import paper
from ringbalance.reports.figure import (
    AS_PAPER,
    FOUND,
    INK,
    MUTED,
    PAPER,
    Drawing,
    Paint,
    curve,
    draw,
    level,
    line,
    logarithmic,
    sheet,
)
from ringbalance.reports.judged import judgement_record, settled_record
from ringbalance.reports.pages.chamber import MOMENT
from ringbalance.reports.pages.loop import SETTINGS, settling
from ringbalance.reports.pages.measured import fit_figures
from ringbalance.reports.pages.standing import CONDITIONS
from ringbalance.reports.pages.tube import TUBE
from ringbalance.reports.run_figures import figures_of
from ringbalance.reports.sections import drawings_in
from ringbalance.reports.sweep_figures import sweep_drawings
from ringbalance.results.requirements import MET, MISSED, OPEN
from ringbalance.results.result import Result
from ringbalance.scene.platform.files import write_whole
from ringbalance.verification import papers

_MIN_ERROR: Final = 1e-12
"""Error at which a model that equals the finest is drawn."""


@dataclass(frozen=True, kw_only=True, repr=False)
class _ResultFigures:
    """Figures of a result, which a notebook shows below each other."""

    drawings: tuple[Drawing, ...]

    def svg(self) -> str:
        """All figures on one sheet, as an SVG file."""
        return sheet(self.drawings)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the sheet. Raises: OSError: the file cannot be written."""
        return write_whole(Path(path), self.svg())

    def _repr_svg_(self) -> str:
        return self.svg()

    def __repr__(self) -> str:
        """Short text for a terminal, which cannot show the figures."""
        return f"<{len(self.drawings)} figures; .save(path) writes them as one SVG file>"


def figures_of_result(result: Result) -> _ResultFigures:
    """Figures of a calibration, a run, a tuning, a design, a fit, a comparison, a trade study or a sweep.

    Raises: TypeError: a result of another type.
    """
    kind = type(result).__name__
    if kind not in _FIGURES:
        raise TypeError(f"of a result of the type {kind} there is no figure")
    return _ResultFigures(drawings=tuple(_FIGURES[kind](result)))


def _calibration(result: Any) -> list[Drawing]:
    document = result.to_dict()
    printed = {
        "drag_coefficient": paper.PAPER_DRAG_COEFFICIENT,
        "lambda_m": paper.PAPER_LAMBDA_M,
        "lambda_spread": papers.LAMBDA_TOLERANCE,
    }
    evidence = {"calibration": document, "paper": printed, "verification": []}
    return drawings_in([section.view(evidence) for section in (CONDITIONS, MOMENT, TUBE)])


def _tuning(result: Any) -> list[Drawing]:
    judged = {"own": result.own, "recommended": result.recommended}
    records = {name: judgement_record(each) for name, each in judged.items() if each is not None}
    curves = [(SETTINGS[name], each["settled"]) for name, each in records.items()]
    return drawings_in([settling(curves, result.recommended.required_fraction)])


def _comparison(result: Any) -> list[Drawing]:
    looks = ({"color": FOUND}, AS_PAPER)
    curves = [
        ({**look, "label": side.scene.name}, settled_record(side.outcomes))
        for look, side in zip(looks, result.sides, strict=True)
    ]
    return drawings_in([settling(curves, result.asked)])


def _design(result: Any) -> list[Drawing]:
    """Fraction of devices and gas pressure of the designs that ran, over their volume, or over the gas where
    no volume varies: those with a verdict on many devices large, the chosen one, as printed, in a ring."""
    space = result.space
    judged = [
        (each, result.judgement if each.point == result.point else each.race.judgement)
        for each in result.tried
    ]
    if not judged:
        return []
    across = ("volume of the cylinder around the chambers", "m^3") if space.sized else ("gas, median", "J")
    names = [", ".join(space.names(each.point).values()) or "design" for each, _ in judged]
    looks = {name: line(index, size=7) for index, name in enumerate(sorted(set(names)))}
    fills = {MET: "full", OPEN: "left", MISSED: "none"}

    def drawing(stem: str, y: str, unit: str, heights: list[float], *paints: Paint) -> Drawing:
        def paint(axes: Axes) -> None:
            for (each, judgement), name, height in zip(judged, names, heights, strict=True):
                at = [each.size if space.sized else each.race.gas], [height]
                few = {} if judgement.meets.size > DEVICES else {"markersize": 4.5}
                axes.plot(*at, **looks[name] | few, linestyle="", fillstyle=fills[judgement.verdict])
                if each.point == result.point:
                    ring: dict[str, Any] = {"color": INK, "marker": "o", "markersize": 13, "label": "chosen"}
                    axes.plot(*at, **ring, linestyle="", fillstyle="none")
            for name, look in looks.items():
                axes.plot([], [], **look, linestyle="", label=name)
            for verdict, fill in fills.items():
                axes.plot([], [], color=MUTED, marker="o", linestyle="", fillstyle=fill, label=verdict)

        return draw(stem, paint, *paints, x=across, y=(y, unit), columns=8, wide=True)

    fractions = [100 * judgement.fraction.value for _, judgement in judged]
    required = level(100 * judged[0][1].required_fraction, "required", color=PAPER, linestyle=":")
    drawings = [drawing("design-fraction", "devices that meet all, in %", "1", fractions, required)]
    if "gas.pressure" in space.paths:
        pressures = [each.point["gas.pressure"] for each, _ in judged]
        drawings.append(drawing("design-pressure", "gas pressure, gauge", "Pa", pressures))
    return drawings


def _trade(result: Any) -> list[Drawing]:
    """Error over designs per second for every timed model."""
    drawings = []
    for quantity in result.to_dict()["quantities"]:
        name = quantity["quantity"]
        speed = {each["model"]: each["designs_per_second"] for each in result.times.get(name, ())}
        models = [model for model in quantity["models"] if model["model"] in speed]
        rates = [speed[model["model"]] for model in models]
        errors = [max(model["error"], _MIN_ERROR) for model in models]
        uncertainty = max(quantity["uncertainty"], _MIN_ERROR)
        drawing = draw(
            f"trade-{name.replace('_', '-')}",
            curve(rates, errors, quantity["title"], color=FOUND, linestyle="", marker="o", markersize=5),
            level(uncertainty, "known to", color=PAPER, linewidth=1, linestyle=":"),
            logarithmic("x"),
            logarithmic("y"),
            x=("designs a second", "1"),
            y=("error against the finest", "1"),
        )
        drawings += [drawing] if models else []
    return drawings


_FIGURES: Final[Mapping[str, Callable[[Any], list[Drawing]]]] = MappingProxyType(
    {
        "Calibration": _calibration,
        "Simulation": lambda run: figures_of(run.scene, run),
        "EccentricRun": lambda run: figures_of(run.scene, run),
        "Tuning": _tuning,
        "Comparison": _comparison,
        "Design": _design,
        "Fit": lambda fit: fit_figures(against_fit(fit.result)),
        "Sweep": sweep_drawings,
        "TradeStudy": _trade,
    }
)
"""Functions that draw a result, by the name of its type."""
