"""Figures of a result for `plot()`, in the report's style."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from ringbalance.identification.documents import against_fit
from ringbalance.reduced_model import paper
from ringbalance.reports.figure import AS_PAPER, FOUND, PAPER, Drawing, curve, draw, level, logarithmic, sheet
from ringbalance.reports.judged import judgement_record, settled_record
from ringbalance.reports.pages.chamber import MOMENT
from ringbalance.reports.pages.loop import SETTINGS, settling
from ringbalance.reports.pages.measured import fit_figures
from ringbalance.reports.pages.standing import CONDITIONS
from ringbalance.reports.pages.tube import TUBE
from ringbalance.reports.run_figures import figures_of
from ringbalance.reports.sections import drawings_in
from ringbalance.reports.sweep_figures import sweep_drawings
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
    """Figures of a calibration, a run, a tuning, a fit, a comparison, a trade study or a sweep.

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
        "Fit": lambda fit: fit_figures(against_fit(fit.result)),
        "Sweep": sweep_drawings,
        "TradeStudy": _trade,
    }
)
"""Functions that draw a result, by the name of its type."""
