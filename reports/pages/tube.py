"""The connecting tube: k and its terms, the flow law, and in each regime the pressure over the crest."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullLocator
from numpy.typing import ArrayLike

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.pressure_profile import HumpProfile
from ringbalance.reports.figure import (
    AS_PAPER,
    FOUND,
    INK,
    MUTED,
    REGIME_COLOURS,
    AxisLabel,
    Drawing,
    Paint,
    curve,
    decade,
    draw,
    level,
    logarithmic,
    note,
    upright,
)
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.traced import budgets_of
from ringbalance.results.numbers import format_given
from ringbalance.scene.arrays import stretches
from ringbalance.scene.models import Scene

_VELOCITY_TICKS: Final = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0]
_VELOCITY: Final[AxisLabel] = ("mean velocity in the tube", "m/s")
_REGIME_LINES: Final[dict[str, Record]] = {
    "siphon": {"linestyle": "-"},
    "separated": {"linestyle": "-", "marker": "o", "markersize": 3.2, "markevery": 5},
    "blocked": {"linestyle": ":"},
    "reverse": {"linestyle": "-."},
    "undecided": {"linestyle": "-", "marker": "x", "markersize": 3.2, "markevery": 5},
}


def _tube(_own: Record, evidence: Record) -> Record:
    tube, budgets = evidence["calibration"]["tube"], budgets_of(evidence)
    velocity, speeds = abs(budgets["velocity"]["value"]), np.log(tube["velocity_m_s"])
    point = [(velocity, budgets["drag_coefficient"]["value"])] if velocity else []
    # The tabulated velocity nearest to the operating point's; the last where nothing flows.
    distance = np.abs(speeds - (math.log(velocity) if velocity else speeds[-1]))
    return {"drag": _drag(tube, point, evidence["paper"]["drag_coefficient"]), "at": int(np.argmin(distance))}


def _drag(tube: Record, point: list[tuple[float, float]], printed: float) -> Drawing:
    """k against velocity and Reynolds number, with its 95 % band and the paper's one number."""
    velocity, k, width = (np.asarray(tube[key]) for key in ("velocity_m_s", "k", "k_uncertainty"))
    bottom = 0.8 * min((k - width).clip(0.2 * k.min()).min(), printed)
    top = 1.3 * max((k + width).max(), printed)
    # Ticks at 1, 2 and 5 up to three decades, beyond that at decades alone.
    ticks = [step * 10.0**e for e in range(-3, 7) for step in ((1, 2, 5) if top < 1e3 * bottom else (1,))]

    def scaled(factor: float) -> Callable[[ArrayLike], ArrayLike]:
        return lambda values: np.asarray(values, dtype=np.float64) * factor

    def reynolds_axis(axes: Axes) -> None:
        per_velocity = tube["reynolds"][-1] / velocity[-1]
        top = axes.secondary_xaxis("top", functions=(scaled(per_velocity), scaled(1 / per_velocity)))
        top.set_xlabel("Reynolds number", color=MUTED)
        top.xaxis.set_major_formatter(FuncFormatter(decade))
        top.xaxis.set_minor_locator(NullLocator())

    def transition(axes: Axes) -> None:
        for state, part in stretches(tube["flow_state"]):
            if state == "transitional":
                ends = velocity[part.start], velocity[part.stop - 1]
                axes.axvspan(*ends, color=MUTED, alpha=0.13, linewidth=0, label=state)

    speeds, coefficients = [u for u, _ in point], [value for _, value in point]
    return draw(
        "drag",
        logarithmic("x", ticks=_VELOCITY_TICKS),
        logarithmic("y", ticks=[tick for tick in ticks if bottom <= tick <= top]),
        transition,
        level(printed, "the paper", **AS_PAPER),
        curve(velocity, k, "calibrated, 95 % band", band=width, color=FOUND),
        curve(
            speeds,
            coefficients,
            "operating point" if point else None,
            linestyle="",
            marker="o",
            color=INK,
            markersize=4.5,
        ),
        reynolds_axis,
        x=_VELOCITY,
        y=("loss coefficient k", "1"),
        xlim=(velocity[0], velocity[-1]),
        ylim=(bottom, top),
        columns=4,
        wide=True,
        height=3.9,
    )


def _law(_own: Record, evidence: Record) -> Record:
    """Velocity over fill ratio at each gas pressure: the calibrated law with its regimes against Eq. 19."""
    law, laws = evidence["flow_law"], []
    fill = np.asarray(law["fill_ratio"])
    for row, regimes in enumerate(law["regime"]):
        velocity, width = (np.asarray(law[key][row]) for key in ("velocity_m_s", "velocity_uncertainty"))
        parts = list(stretches(list(regimes)))
        first = dict(reversed(parts))
        branches = (
            curve(
                fill[part],
                velocity[part],
                f"calibrated, {regime}" if first[regime] == part else None,
                color=FOUND,
                **_REGIME_LINES[regime],
            )
            for regime, part in parts
        )
        figure = draw(
            f"flow-law-{row}",
            curve(fill, law["velocity_paper_m_s"][row], "Eq. 19", **AS_PAPER),
            curve(fill, velocity, band=width, color=FOUND, linewidth=0),
            *branches,
            x=("fill ratio of the driven chamber", "1"),
            y=("velocity in the tube", "m/s"),
            ylim=(0, None),
            columns=3,
        )
        laws.append(figure)
    return {"laws": laws}


_PATH_POINTS: Final = 161
_FILL_FRACTIONS: Final = np.linspace(0.06, 0.94, 23)
"""Fills at which a regime is searched, over the largest."""
_PRESSURE_FACTORS: Final = (1.0, 0.6, 0.3, 1.5, 2.0)
"""Gas pressures at which a regime is searched, over the scene's."""
_REGIMES: Final = (Regime.SIPHON, Regime.SEPARATED, Regime.BLOCKED, Regime.REVERSE)


def _collect(work: Work) -> Record | None:
    """One operating state of every regime that this tube can be in, with its pressures along the path."""
    scene, law = work.ring, work.calibration.flow_law
    if scene.tube.hump_radius is None:
        return None
    states, absent = [], []
    for regime in _REGIMES:
        fills, primed = _FILL_FRACTIONS * law.max_fill_ratio, regime is Regime.REVERSE
        # The middle one of the fills with that regime, at the first gas pressure that has it.
        for pressure in (0.0,) if primed else tuple(f * scene.gas.pressure for f in _PRESSURE_FACTORS):
            flow = law.evaluate(fill_ratio=fills, gas_pressure=pressure, primed=primed)
            rows = np.flatnonzero(flow.regime == regime)
            if rows.size:
                fill = float(fills[rows[rows.size // 2]])
                states.append(_record(work.calibration.scene, law, fill, pressure, primed))
                break
        else:
            absent.append(regime.label)
    return {"hump_radius_m": scene.tube.hump_radius, "states": states, "absent": absent}


def _record(scene: Scene, law: CalibratedLaw, fill: float, pressure: float, primed: bool) -> Record:
    profile: HumpProfile = HumpProfile.of(
        scene=scene, law=law, fill_ratio=fill, gas_pressure=pressure, primed=primed, points=_PATH_POINTS
    )
    return {
        "regime": profile.regime.label,
        "fill_ratio": fill,
        "opposite_fill_ratio": law.max_fill_ratio - fill,
        "gas_pressure_Pa": pressure,
        "velocity_m_s": profile.velocity,
        "path_m": profile.path.tolist(),
        "pressure_Pa": profile.pressure.tolist(),
        "full": profile.full.astype(int).tolist(),
        "hump_path_m": profile.hump_path,
        "hump_pressure_Pa": profile.hump_pressure,
        "cavity_pressure_Pa": profile.cavity_pressure,
        "margin_Pa": profile.cavitation_margin,
        "margin_uncertainty_Pa": profile.cavitation_margin_uncertainty,
        "column": _column_code(profile.cavitation_margin, profile.cavitation_margin_uncertainty),
    }


def _column_code(margin: float | None, width: float | None) -> str:
    """State of a full column, by its margin and half-width, Pa: none, undecided, holds or separates."""
    if margin is None:
        return "none"
    if width is not None and abs(margin) <= width:
        return "undecided"
    return "holds" if margin > 0 else "separates"


def _crest(record: Record, _evidence: Record) -> Record | None:
    """Gauge pressure along the path, one line per regime, dotted where the tube is not full."""
    states = record["states"]
    if not states:
        return None
    first = states[0]
    crest, cavity, length = first["hump_path_m"], first["cavity_pressure_Pa"], first["path_m"][-1]
    pressures = [value for state in states for value in (*state["pressure_Pa"], cavity)]
    low, high = min(pressures), max(pressures)
    bottom, top = low - 0.09 * (high - low), high + 0.05 * (high - low)
    lines: list[Paint] = []
    for state in states:
        path, pressure = np.asarray(state["path_m"]), np.asarray(state["pressure_Pa"])
        label: str | None = f"{state['regime']}, {format_given(state['gas_pressure_Pa'], 'Pa', digits=3)}"
        for full, part in stretches(state["full"]):
            look = {"color": REGIME_COLOURS[state["regime"]], "linestyle": "-" if full else (0, (1, 2))}
            lines.append(curve(path[part], pressure[part], label if full else None, **look))
            label = None if full else label
    figure = draw(
        "hump-pressure",
        *lines,
        level(cavity, "cavity pressure", color=MUTED, linewidth=1, linestyle=(0, (5, 2))),
        upright(crest, color=MUTED, linewidth=0.8, linestyle=":"),
        note("siphon crest", (crest, top), (5, -9)),
        x=("path along the tube from the driven chamber", "m"),
        y=("gauge pressure", "Pa"),
        xlim=(-0.015 * length, 1.015 * length),
        ylim=(bottom, top),
        columns=3,
        wide=True,
        height=4.0,
    )
    return {"figure": figure}


TUBE: Final = Section(name="tube", title="The connecting tube", show=_tube)
LAW: Final = Section(name="law", title="The flow law", show=_law)
CREST: Final = Section(name="hump", title="Pressure over the siphon crest", collect=_collect, show=_crest)
