"""The command `ringbalance calibrate`, and a calibration as a person reads it."""

from __future__ import annotations

import json as json_format
from collections.abc import Iterator
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ringbalance.reduced_model.budget import UNSTATED
from ringbalance.reduced_model.calibration import Calibration
from ringbalance.reduced_model.calibration import calibrate as calibrate_scene
from ringbalance.reduced_model.chamber.mesh_findings import mesh_findings
from ringbalance.reduced_model.documents import (
    PRESSURE_FACTORS,
    REMEDIES,
    calibration_document,
    chamber_status,
    paper_columns,
    velocity_status,
)
from ringbalance.reduced_model.gas_line import line_text, line_warning
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.operating.tube_liquid import TubeLiquid
from ringbalance.results.numbers import believed, measured, plain, rounded
from ringbalance.scene.loader import load_scene
from ringbalance.scene.narrowing import Models, with_tolerance
from ringbalance.scene.platform.files import check_file
from ringbalance.scene.platform.terminal import activity, messages_console, results_console

DONE = 0


def calibrate(
    scene: Path,
    *,
    json: bool = False,
    save: Path | None = None,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Calibrate a disc: lambda, k(u) and the flow law, with uncertainties.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        save: also write the flow law to this file, for `simulate --law`.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code 0.

    Raises:
        SceneError: a scene that cannot be used.
        OSError: the law's file cannot be written.
    """
    told = with_tolerance(load_scene(scene), tolerance=tolerance, models=models)
    if save is not None:
        check_file(save)
    with activity("calibrate", "pressure and moment over the fill range, losses of the tube ..."):
        found = calibrate_scene(told)
    if json:
        print(json_format.dumps(calibration_document(found), allow_nan=False))
    else:
        results_console().print(_calibration_view(found))
    if save is not None:
        found.flow_law.save(save)
        messages_console().print(f"law written to {save}", highlight=False)
    return DONE


_ASIDE: Final = 0.01
"""Angle below which a chamber counts as symmetric, deg."""
_MARKS: Final = MappingProxyType(
    {
        Regime.SIPHON: "",
        Regime.SEPARATED: "*",
        Regime.REVERSE: "r",
        Regime.UNDECIDED: "?",
    }
)


def _calibration_view(calibration: Calibration) -> RenderableType:
    """Summary, chamber, tube, law and models of a calibration, for a rich console."""
    return Group(
        _summary(calibration),
        _chamber_table(calibration),
        _tube_table(calibration),
        _law_table(calibration),
        _models_table(calibration),
        Text(calibration.identifiability, style="dim"),
    )


def _table(title: str, *columns: str, left: int = 1) -> Table:
    table = Table(
        title=title,
        title_justify="left",
        title_style="bold",
        caption_justify="left",
        header_style="bold",
        box=SIMPLE_HEAD,
        padding=0,
        pad_edge=False,
    )
    for i, name in enumerate(columns):
        table.add_column(name, justify="left" if i < left else "right")
    return table


def _measured(
    calibration: Calibration, value: float, total: float, unit: str = "", *, scale: float = 1.0
) -> str:
    """Value ± uncertainty and unit, as far as the scene's inputs can be believed."""
    known = believed(value, total, stated=_stated(calibration))
    return f"{plain(measured(scale * value, None if known is None else scale * known))} {unit}".rstrip()


def _shown(calibration: Calibration, name: str, unit: str = "", *, scale: float = 1.0) -> str:
    budget = calibration.budgets[name]
    return _measured(calibration, budget.value, budget.total, unit, scale=scale)


def _rounded(calibration: Calibration, value: float, total: float) -> str:
    return rounded(value, believed(value, total, stated=_stated(calibration)))


def _stated(calibration: Calibration) -> bool:
    return bool(calibration.scene.uncertainty)


def _summary(calibration: Calibration) -> Table:
    table = Table(
        title=calibration.scene.name, title_justify="left", title_style="bold", show_header=False, box=None
    )
    table.add_column(style="bold")
    table.add_column()
    for name, text in _summary_rows(calibration):
        table.add_row(name, text)
    return table


def _summary_rows(calibration: Calibration) -> Iterator[tuple[str, str]]:
    chamber, point, told = calibration.chamber, calibration.operating_point, calibration.budgets
    lam = told["lambda"]
    yield "chamber", _shown(calibration, "chamber_volume", "ml", scale=1e6)
    yield (
        "lambda",
        f"{_shown(calibration, 'lambda', 'mm', scale=1e3)} per transferred mass "
        f"({_rounded(calibration, 1e3 * lam.value / 2, 1e3 * lam.total / 2)} mm per mass difference), "
        f"varies by {100 * calibration.lambda_variation:.2g} % over the fill range",
    )
    yield from _direction(calibration)
    yield "usable", _usable_text(calibration)
    yield "operating point", _point_text(calibration)
    if "drag_coefficient" in told:
        yield "k there", f"{_shown(calibration, 'drag_coefficient')} at {point.loss_velocity:.3g} m/s"
    stall = told["stall_pressure"]
    paper = _rounded(calibration, point.stall_paper / 1e6, stall.total / 1e6)
    yield "full siphon stalls", f"at {_mpa(calibration, 'stall_pressure')} when empty (Eq. 19: {paper} MPa)"
    if "priming_pressure_vented" in told:
        yield (
            "over the siphon crest",
            f"{_mpa(calibration, 'priming_pressure_vented')} vented, driven chamber empty; "
            f"{_mpa(calibration, 'priming_pressure_trapped')} trapped, equal fills",
        )
    if point.cavitation_margin is not None:
        yield "cavitation margin", _margin_text(calibration)
    yield "liquid in the tube", _tube_liquid_text(calibration.tube_liquid)
    yield "gas line", line_text(calibration.gas_line)
    if line_warning(calibration.gas_line):
        yield "note", line_warning(calibration.gas_line)
    if calibration.holding.finding is not None:
        yield "warning", calibration.holding.finding.text
    if not _stated(calibration):
        yield "note", UNSTATED[0].lower() + UNSTATED[1:].rstrip(".")
    if not chamber.status.ok:
        yield "note", chamber.status.text
    for finding in mesh_findings(calibration.scene):
        yield "warning", finding.text
    if calibration.instability is not None and calibration.instability.warning:
        yield "warning", calibration.instability.warning


def _direction(calibration: Calibration) -> Iterator[tuple[str, str]]:
    """Where an imported chamber is not symmetric, the angle from its middle in which its pair acts."""
    total, moment = calibration.scene.disc.max_fill_ratio, calibration.flow_law.moment
    fill = total * np.linspace(0.525, 1.0, 20)
    angles = np.degrees(np.angle(moment.pair_vector(fill_ratio=fill, opposite_fill_ratio=total - fill)))
    if np.max(np.abs(angles)) >= _ASIDE:
        text = (
            f"a pair acts {angles[0]:.2g} deg from the middle of its chambers near equal fills, "
            f"{angles[-1]:.2g} deg with all liquid in one; the closed loop follows that, moments and lambda "
            "are those along the middle"
        )
        yield "direction", text


def _mpa(calibration: Calibration, name: str) -> str:
    return _shown(calibration, name, "MPa", scale=1e-6)


def _usable_text(calibration: Calibration) -> str:
    rest, told = calibration.residual, calibration.budgets
    fill, total = told["least_fill_ratio"].total, told["usable_moment"].total
    moment = f"{_shown(calibration, 'usable_moment', 'g mm', scale=1e6)} a pair"
    reach = _measured(calibration, rest.reach, rest.reach_share * total, "g mm", scale=1e6)
    if rest.least_fill_ratio == 0:
        return (
            f"{moment}, {reach} all pairs in any direction; no gas enters the port before a chamber is empty"
        )
    by_geometry = _rounded(calibration, 1e6 * rest.pair_moment, 1e6 * total)
    width = 2 * fill * calibration.chamber.volume
    volume = _measured(calibration, rest.usable_volume, width, "ml", scale=1e6)
    depth = _measured(calibration, rest.depth, rest.depth_uncertainty, "mm", scale=1e3)
    why = (
        f"with {depth} of liquid over the port, gas passes through"
        if rest.limited_by == "draw_down"
        else "this gas pressure moves no liquid: raise gas.pressure"
    )
    return (
        f"{moment} ({by_geometry} by geometry), {reach} all pairs in any direction, {volume}, fills "
        f"{_measured(calibration, rest.least_fill_ratio, fill)} to "
        f"{_rounded(calibration, rest.largest_fill_ratio, fill)}: below, {why}"
    )


def _tube_liquid_text(found: TubeLiquid) -> str:
    moments = [f"{1e6 * abs(held.moment):.2g} g mm" for held in (found.flowing, found.after)]
    changes = [f"{1e6 * value:.2g}" for value in (found.flowing_vibration, found.lasting_vibration)]
    text = (
        f"{moments[0]} while it flows, {moments[1]} at rest afterwards: the vibration changes by "
        f"{changes[0]} um and lastingly by {changes[1]} um, of a limit of {1e6 * found.limit:.2g} um"
    )
    if not found.returned_volume:
        return text
    return f"{text}; up to {1e6 * found.returned_volume:.2g} ml fall back from the crest after each injection"


def _point_text(calibration: Calibration) -> str:
    point, told = calibration.operating_point, calibration.budgets
    where = f"{point.gas_pressure / 1e6:.4g} MPa, equal fills of {point.fill_ratio:g}"
    if point.regime is Regime.BLOCKED:
        names = ("priming_pressure_vented", "stall_pressure")
        needed = max((name for name in names if name in told), key=lambda name: told[name].value)
        return f"{where}: blocked; raise gas.pressure towards {_mpa(calibration, needed)}"
    return f"{where}: {point.regime.label}, {_shown(calibration, 'velocity', 'm/s')}"


def _margin_text(calibration: Calibration) -> str:
    """How far a full siphon's pressure over the crest is from separation there."""
    point, budget = calibration.operating_point, calibration.budgets.get("cavitation_margin")
    margin, width = point.cavitation_margin or 0.0, point.cavitation_margin_uncertainty or 0.0
    width = width if budget is None else budget.total
    verdict = (
        "the column holds over the siphon crest"
        if margin > 0
        else "a full siphon would separate over the siphon crest"
    )
    if abs(margin) < width:
        verdict += ", within its uncertainty either way"
    shown = _measured(calibration, margin, width, "MPa", scale=1e-6)
    sign = "+" if margin > 0 else ""
    cavity = _rounded(calibration, (point.cavity_pressure or 0.0) / 1e6, width / 1e6)
    return f"{sign}{shown} above {cavity} MPa: {verdict}"


def _chamber_table(calibration: Calibration) -> Table:
    chamber, at = calibration.chamber, list(calibration.chamber.reported)
    states = chamber_status(calibration)
    limited = [state for state in REMEDIES if state in states]
    columns_shown = ("fill", "R1' mm", "p MPa", "Eq. 12", "off %", "U g mm", "Eq. 7", "off %")
    table = _table("Chamber", *columns_shown, *(["state"] if limited else []))
    if limited:
        table.caption = "; ".join(f"{state}: {REMEDIES[state]}" for state in limited)
    columns = paper_columns(calibration, chamber.fill_ratio[at])
    paper_pressure, paper_moment = columns["wall_pressure_paper_Pa"], columns["moment_paper_kg_m"]
    pressure_total, moment_total = (
        np.maximum(np.hypot(curve.uncertainty, curve.inputs), 1e-9 * np.max(curve.value))
        for curve in (chamber.wall_pressure, chamber.moment)
    )
    for row, i in enumerate(at):
        p, u = float(chamber.wall_pressure.value[i]), float(chamber.moment.value[i])
        table.add_row(
            f"{chamber.fill_ratio[i]:g}",
            f"{1e3 * chamber.ring.surface_radius[i]:.2f}",
            _rounded(calibration, p / 1e6, pressure_total[i] / 1e6),
            _rounded(calibration, paper_pressure[row] / 1e6, pressure_total[i] / 1e6),
            _off(float(paper_pressure[row]), p),
            _rounded(calibration, 1e6 * u, 1e6 * moment_total[i]),
            _rounded(calibration, 1e6 * paper_moment[row], 1e6 * moment_total[i]),
            _off(float(paper_moment[row]), u),
            *([str(states[row])] if limited else []),
        )
    return table


def _off(found: float, reference: float) -> str:
    """Percent, a zero without sign."""
    shown = f"{100 * (found / reference - 1):+.1f}" if reference else ""
    return "0.0" if shown in ("+0.0", "-0.0") else shown


def _tube_table(calibration: Calibration) -> Table:
    tube = calibration.tube
    terms = {name: term for name, term in tube.terms.items() if np.any(term)}
    table = _table("Tube", "u m/s", "Re", "k", "±", "state", *terms)
    table.columns[4].justify = "left"
    for i in dict.fromkeys(np.linspace(0, tube.velocity.size - 1, 9).astype(int).tolist()):
        table.add_row(
            f"{tube.velocity[i]:.3g}",
            f"{tube.reynolds[i]:.0f}",
            *(rounded(float(v[i]), float(tube.k.uncertainty[i])) for v in (tube.k.value, tube.k.uncertainty)),
            f"{tube.flow_state[i]}{'' if tube.in_range[i] else '*'}",
            *(_short(float(term[i])) for term in terms.values()),
        )
    if tube.range_notes:
        table.caption = "* outside the range of a source: " + "; ".join(tube.range_notes)
    return table


def _short(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.1f}" if abs(value) >= 10 else f"{value:.2f}"


def _law_table(calibration: Calibration) -> Table:
    x = np.linspace(0, calibration.flow_law.max_fill_ratio, 5)
    table = _table("Velocity from an empty tube, m/s (Eq. 19)", "MPa", *(f"x = {v:.3g}" for v in x))
    caption = (
        "* separated at the siphon crest, ? siphon or separated cannot be told, r reverse, - blocked; "
        "x is the driven chamber's fill ratio"
    )
    for factor in PRESSURE_FACTORS:
        p = factor * calibration.scene.gas.pressure
        flow = calibration.flow_law.evaluate(fill_ratio=x, gas_pressure=p)
        by_paper = calibration.paper_law.evaluate(fill_ratio=x, gas_pressure=p).velocity
        cells = (
            _cell(calibration, Regime(int(r)), *values)
            for r, *values in zip(flow.regime, flow.velocity, flow.uncertainty, by_paper, strict=True)
        )
        table.add_row(f"{p / 1e6:.3g}", *cells)
    states = velocity_status(calibration, x)
    limited = [state for state in REMEDIES if state in states]
    if limited:
        table.add_row("state", *(str(state) for state in states))
        caption += "; " + "; ".join(f"{state}: {REMEDIES[state]}" for state in limited)
    table.caption = caption
    return table


def _cell(calibration: Calibration, regime: Regime, velocity: float, total: float, by_paper: float) -> str:
    shown = "-" if regime is Regime.BLOCKED else f"{_rounded(calibration, velocity, total)}{_MARKS[regime]}"
    return f"{shown} ({by_paper:.1f})"


def _models_table(calibration: Calibration) -> Table:
    table = _table("Models used", "term", "model", "contribution", "why", left=2)
    table.columns[3].justify = "left"
    for term in calibration.models_used:
        share = term.estimated_contribution
        shown = "unknown" if share is None else f"{100 * share:.3g} %"
        table.add_row(term.term, term.model, shown, term.why)
    return table
