"""The pressure along the tube's path in each regime, with the margin before the column separates."""

from __future__ import annotations

from itertools import groupby
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.pressure_profile import HumpProfile
from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.numbers import given, shown
from ringbalance.scene.models import Scene

_POINTS: Final = 161
_SHARES: Final = np.linspace(0.06, 0.94, 23)
"""Fills at which a regime is looked for, as shares of the largest."""
_FACTORS: Final = (1.0, 0.6, 0.3, 1.5, 2.0)
"""Gas pressures at which it is looked for, over the scene's."""
_ORDER: Final = (Regime.SIPHON, Regime.SEPARATED, Regime.BLOCKED, Regime.REVERSE)


def _path_figure(found: Record) -> Drawing:
    """Gauge pressure along the path, one line a regime, dotted where the tube is not full."""
    states = found["states"]

    def paint(axes: Axes) -> None:
        for state in states:
            _line(axes, state)
        cavity = states[0]["cavity_pressure_Pa"] * 1e-6
        axes.axhline(cavity, color=style.MUTED, linewidth=1, linestyle=(0, (5, 2)), label="cavity pressure")
        hump = states[0]["hump_path_m"] * 1e3
        axes.axvline(hump, color=style.MUTED, linewidth=0.8, linestyle=":")
        _margin(axes, states, hump)
        length = states[0]["path_m"][-1] * 1e3
        axes.set_xlim(-0.015 * length, 1.015 * length)
        low, high = axes.get_ylim()
        axes.set_ylim(low - 0.04 * (high - low), high)
        axes.annotate("hump", (hump, high), xytext=(5, -9), textcoords="offset points", color=style.MUTED)

    return draw(
        columns=3,
        x="path along the tube from the driven chamber in mm",
        y="gauge pressure in MPa",
        name="hump-pressure",
        paint=paint,
        wide=True,
        height=4.0,
        alt="Pressure along the tube: it falls towards the siphon crest and rises behind it; in the "
        "separated regime it stays at the cavity pressure behind it until the tube is full again.",
    )


def _line(axes: Axes, state: Record) -> None:
    path, pressure = np.asarray(state["path_m"]) * 1e3, np.asarray(state["pressure_Pa"]) * 1e-6
    colour, start = style.REGIME_COLOURS[state["regime"]], 0
    gas = given(state["gas_pressure_Pa"], "Pa", digits=3)
    label: str | None = f"{state['regime']}, {gas}"
    for full, members in groupby(state["full"]):
        count = len(list(members))
        part = slice(max(start - 1, 0) if not full else start, start + count + (0 if full else 1))
        dashes = "-" if full else (0, (1, 2))
        axes.plot(path[part], pressure[part], color=colour, linestyle=dashes, label=label if full else None)
        label = None if full else label
        start += count


def _margin(axes: Axes, states: list[Record], hump: float) -> None:
    """The siphon's margin at the crest, as an arrow with its size."""
    siphons = [s for s in states if s["regime"] == "siphon" and s["margin_Pa"] is not None]
    if not siphons:
        return
    state = siphons[0]
    low, high = state["cavity_pressure_Pa"] * 1e-6, state["hump_pressure_Pa"] * 1e-6
    axes.annotate(
        f"margin {shown(state['margin_Pa'], 'Pa', digits=2)}",
        (hump, high),
        xytext=(10, 26),
        textcoords="offset points",
        color=style.FOUND,
        arrowprops={"arrowstyle": "-", "color": style.FOUND, "linewidth": 0.7},
    )
    axes.plot([hump, hump], [low, high], color=style.FOUND, linewidth=3, alpha=0.6, solid_capstyle="butt")


def _collect(work: Work) -> Record | None:
    """One operating state of every regime that this tube can be in, with its pressures along the path."""
    law = work.calibration.flow_law
    if work.scene.tube.hump_radius is None:
        return None
    found = [(regime, _state_in(regime, work.scene, law)) for regime in _ORDER]
    return {
        "hump_radius_m": work.scene.tube.hump_radius,
        "states": [_record(work.calibration.scene, law, *state) for _, state in found if state is not None],
        "absent": [regime.label for regime, state in found if state is None],
    }


def _state_in(regime: Regime, scene: Scene, law: CalibratedLaw) -> tuple[float, float, bool] | None:
    """Fill, gas pressure and whether the tube is primed, of the first pressure with that regime."""
    fills, primed = _SHARES * law.max_fill_ratio, regime is Regime.REVERSE
    for pressure in (0.0,) if primed else tuple(f * scene.gas.pressure for f in _FACTORS):
        flow = law.evaluate(fill_ratio=fills, gas_pressure=pressure, primed=primed)
        there = np.flatnonzero(flow.regime == regime)
        if there.size:
            return float(fills[there[there.size // 2]]), pressure, primed
    return None


def _record(scene: Scene, law: CalibratedLaw, fill: float, pressure: float, primed: bool) -> Record:
    found: HumpProfile = HumpProfile.of(
        scene=scene, law=law, fill_ratio=fill, gas_pressure=pressure, primed=primed, points=_POINTS
    )
    return {
        "regime": found.regime.label,
        "fill_ratio": fill,
        "opposite_fill_ratio": law.max_fill_ratio - fill,
        "gas_pressure_Pa": pressure,
        "velocity_m_s": found.velocity,
        "path_m": found.path.tolist(),
        "pressure_Pa": found.pressure.tolist(),
        "full": found.full.astype(int).tolist(),
        "hump_path_m": found.hump_path,
        "hump_pressure_Pa": found.hump_pressure,
        "cavity_pressure_Pa": found.cavity_pressure,
        "margin_Pa": found.cavitation_margin,
        "margin_uncertainty_Pa": found.cavitation_margin_uncertainty,
        "column": column_code(found.cavitation_margin, found.cavitation_margin_uncertainty),
    }


def column_code(margin: float | None, width: float | None) -> str:
    """What a full column does, by its margin and half-width, Pa: none, undecided, holds or separates."""
    if margin is None:
        return "none"
    if width is not None and abs(margin) <= width:
        return "undecided"
    return "holds" if margin > 0 else "separates"


def _view(found: Record, _evidence: Record) -> Record | None:
    return {"figure": _path_figure(found)} if found["states"] else None


SECTION: Final = Section(name="hump", title="Pressure over the siphon crest", collect=_collect, show=_view)
