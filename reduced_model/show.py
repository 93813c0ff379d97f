"""A calibration in a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from types import MappingProxyType
from typing import Final

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ringbalance.reduced_model.calibration import Calibration, lambda_variation
from ringbalance.reduced_model.chamber.row_status import REMEDIES, row_status
from ringbalance.reduced_model.documents import PRESSURE_FACTORS, paper_columns
from ringbalance.reduced_model.gas_line import line_text, line_warning
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.operating_point import OperatingPoint

_MARKS: Final = MappingProxyType(
    {
        Regime.BLOCKED: "-",
        Regime.SIPHON: "{:.1f}",
        Regime.SEPARATED: "{:.1f}*",
        Regime.REVERSE: "{:.1f}r",
        Regime.UNDECIDED: "{:.1f}?",
    }
)


def calibration_view(calibration: Calibration) -> RenderableType:
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


def _mpa(pressure: float | None) -> str:
    return "none" if pressure is None else f"{pressure / 1e6:.3f} MPa"


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
    chamber, point = calibration.chamber, calibration.operating_point
    lam = chamber.moment_per_mass
    width = float(np.hypot(lam.uncertainty, chamber.moment_per_mass_inputs))
    yield "chamber", f"{1e6 * chamber.volume:.2f} ml"
    yield (
        "lambda",
        f"{1e3 * float(lam.value):.3f} mm ± {1e3 * width:.2g} mm per transferred mass "
        f"({1e3 * float(lam.value) / 2:.3f} mm per mass difference), "
        f"varies by {100 * lambda_variation(calibration=calibration):.2g} % over the fill range",
    )
    yield "usable", _usable_text(calibration)
    yield "operating point", _point_text(point)
    if point.k is not None and point.k_uncertainty is not None:
        yield "k there", f"{point.k:.2f} ± {point.k_uncertainty:.2f} at {point.loss_velocity:.3g} m/s"
    yield "full siphon stalls", f"at {_mpa(point.stall)} when empty (Eq. 19: {_mpa(point.stall_paper)})"
    if point.priming_vented is not None:
        yield (
            "over the siphon crest",
            f"{_mpa(point.priming_vented)} vented, driven chamber empty; "
            f"{_mpa(point.priming_trapped)} trapped, equal fills",
        )
    if point.cavitation_margin is not None:
        yield "cavitation margin", _margin_text(point)
    yield "gas line", line_text(calibration.gas_line)
    if line_warning(calibration.gas_line):
        yield "note", line_warning(calibration.gas_line)
    if not chamber.status.ok:
        yield "note", chamber.status.text
    if calibration.instability is not None and calibration.instability.warning:
        yield "warning", calibration.instability.warning


def _usable_text(calibration: Calibration) -> str:
    rest = calibration.residual
    if rest.fill_ratio == 0:
        return f"{1e6 * rest.pair_moment:.0f} g mm a pair; no gas enters the port before a chamber is empty"
    return (
        f"{1e6 * rest.usable_pair_moment:.0f} ± {1e6 * rest.usable_pair_moment_uncertainty:.0f} g mm a pair "
        f"({1e6 * rest.pair_moment:.0f} by geometry) and {1e6 * rest.usable_volume:.1f} ± "
        f"{1e6 * rest.usable_volume_uncertainty:.2g} ml, fills {rest.fill_ratio:.3f} ± "
        f"{rest.fill_ratio_uncertainty:.2g} to {rest.largest_fill_ratio:.3f}: below, with "
        f"{1e3 * rest.depth:.2f} ± {1e3 * rest.depth_uncertainty:.2g} mm of liquid over the port, gas passes "
        "through"
    )


def _point_text(point: OperatingPoint) -> str:
    where = f"{_mpa(point.gas_pressure)}, equal fills of {point.fill_ratio:g}"
    if point.regime is Regime.BLOCKED:
        needed = [p for p in (point.priming_vented, point.stall) if p is not None]
        return f"{where}: blocked; raise gas.pressure towards {_mpa(max(needed))}"
    return f"{where}: {point.regime.label}, {point.velocity:.2f} ± {point.velocity_uncertainty:.2f} m/s"


def _margin_text(point: OperatingPoint) -> str:
    """How far a full siphon's pressure over the crest is from separation there."""
    margin, width = point.cavitation_margin or 0.0, point.cavitation_margin_uncertainty or 0.0
    told = (
        "the column holds over the siphon crest"
        if margin > 0
        else "a full siphon would separate over the siphon crest"
    )
    if abs(margin) < width:
        told += ", within its uncertainty either way"
    return f"{margin / 1e6:+.3f} ± {width / 1e6:.3f} MPa above {_mpa(point.cavity_pressure)}: {told}"


def _chamber_table(calibration: Calibration) -> Table:
    chamber, at = calibration.chamber, list(calibration.chamber.reported)
    states = row_status(calibration.scene, fill_ratio=chamber.fill_ratio[at], closed=chamber.ring.closed[at])
    limited = [state for state in REMEDIES if state in states]
    columns_shown = ("fill", "R1' mm", "p MPa", "Eq. 12", "off %", "U g mm", "Eq. 7", "off %")
    table = _table("Chamber", *columns_shown, *(["state"] if limited else []))
    if limited:
        table.caption = "; ".join(f"{state}: {REMEDIES[state]}" for state in limited)
    columns = paper_columns(calibration, chamber.fill_ratio[at])
    paper_pressure, paper_moment = columns["wall_pressure_paper_Pa"], columns["moment_paper_kg_m"]
    for row, i in enumerate(at):
        p, u = float(chamber.wall_pressure.value[i]), float(chamber.moment.value[i])
        table.add_row(
            f"{chamber.fill_ratio[i]:g}",
            f"{1e3 * chamber.ring.surface_radius[i]:.2f}",
            f"{p / 1e6:.4f}",
            f"{paper_pressure[row] / 1e6:.4f}",
            _off(float(paper_pressure[row]), p),
            f"{1e6 * u:.1f}",
            f"{1e6 * paper_moment[row]:.1f}",
            _off(float(paper_moment[row]), u),
            *([str(states[row])] if limited else []),
        )
    return table


def _off(found: float, reference: float) -> str:
    return f"{100 * (found / reference - 1):+.1f}" if reference else ""


def _tube_table(calibration: Calibration) -> Table:
    tube = calibration.tube
    terms = {name: term for name, term in tube.terms.items() if np.any(term)}
    table = _table("Tube", "u m/s", "Re", "k", "±", "state", *terms)
    table.columns[4].justify = "left"
    for i in np.unique(np.linspace(0, tube.velocity.size - 1, 9).astype(int)):
        table.add_row(
            f"{tube.velocity[i]:.3g}",
            f"{tube.reynolds[i]:.0f}",
            _short(float(tube.k.value[i])),
            _short(float(tube.k.uncertainty[i])),
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
    table.caption = (
        "* separated at the siphon crest, ? siphon or separated cannot be told, r reverse, - blocked; "
        "x is the driven chamber's fill ratio"
    )
    for factor in PRESSURE_FACTORS:
        p = factor * calibration.scene.gas.pressure
        flow = calibration.flow_law.evaluate(fill_ratio=x, gas_pressure=p)
        by_paper = calibration.paper_law.evaluate(fill_ratio=x, gas_pressure=p).velocity
        cells = (
            f"{_MARKS[Regime(int(r))].format(u)} ({v:.1f})"
            for u, r, v in zip(flow.velocity, flow.regime, by_paper, strict=True)
        )
        table.add_row(f"{p / 1e6:.3g}", *cells)
    return table


def _models_table(calibration: Calibration) -> Table:
    table = _table("Models used", "term", "model", "contribution", "why", left=2)
    table.columns[3].justify = "left"
    for term in calibration.models_used:
        share = term.estimated_contribution
        shown = "unknown" if share is None else f"{100 * share:.3g} %"
        table.add_row(term.term, term.model, shown, term.why)
    return table
