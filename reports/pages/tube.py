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
    Axis,
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
from ringbalance.results.numbers import given
from ringbalance.scene.arrays import stretches
from ringbalance.scene.models import Scene

_VELOCITY_TICKS: Final = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0]
_VELOCITY: Final[Axis] = ("mean velocity in the tube", "m/s")
_REGIME_LINES: Final[dict[str, Record]] = {
    "siphon": {"linestyle": "-"},
    "separated": {"linestyle": "-", "marker": "o", "markersize": 3.2, "markevery": 5},
    "blocked": {"linestyle": ":"},
    "reverse": {"linestyle": "-."},
    "undecided": {"linestyle": "-", "marker": "x", "markersize": 3.2, "markevery": 5},
}


def _tube(_own: Record, evidence: Record) -> Record:
    tube, known = evidence["calibration"]["tube"], budgets_of(evidence)
    velocity = abs(known["velocity"]["value"])
    point = [(velocity, known["drag_coefficient"]["value"])] if velocity else []
    return {
        "drag": _drag(tube, point, evidence["paper"]["drag_coefficient"]),
        "at": _nearest(tube, velocity),
    }


def _nearest(tube: Record, velocity: float) -> int:
    """Place of the tabulated velocity nearest to the operating point's; the last where nothing flows."""
    speeds = np.log(tube["velocity_m_s"])
    return int(np.argmin(np.abs(speeds - (math.log(velocity) if velocity else speeds[-1]))))


def _drag(tube: Record, point: list[tuple[float, float]], printed: float) -> Drawing:
    """k against velocity and Reynolds number, with its 95 % band and the paper's one number."""
    velocity, k, width = (np.asarray(tube[key]) for key in ("velocity_m_s", "k", "k_uncertainty"))
    bottom = 0.8 * min((k - width).clip(0.2 * k.min()).min(), printed)
    top = 1.3 * max((k + width).max(), printed)
    # 1-2-5 ticks of a few decades, decades alone beyond three.
    ticks = [step * 10.0**e for e in range(-3, 7) for step in ((1, 2, 5) if top < 1e3 * bottom else (1,))]

    def transition(axes: Axes) -> None:
        for state, part in stretches(tube["flow_state"]):
            if state == "transitional":
                ends = velocity[part.start], velocity[part.stop - 1]
                axes.axvspan(*ends, color=MUTED, alpha=0.13, linewidth=0, label=state)

    speeds, coefficients = [u for u, _ in point], [each for _, each in point]
    return draw(
        "drag",
        logarithmic("x", ticks=_VELOCITY_TICKS),
        logarithmic("y", ticks=[tick for tick in ticks if bottom <= tick <= top]),
        transition,
        level(printed, "the paper", **AS_PAPER),
        curve(velocity, k, "found, 95 % band", band=width, color=FOUND),
        curve(
            speeds,
            coefficients,
            "operating point" if point else None,
            linestyle="",
            marker="o",
            color=INK,
            markersize=4.5,
        ),
        _reynolds_axis(tube["reynolds"][-1] / velocity[-1]),
        x=_VELOCITY,
        y=("loss coefficient k", "1"),
        xlim=(velocity[0], velocity[-1]),
        ylim=(bottom, top),
        columns=4,
        wide=True,
        height=3.9,
    )


def _reynolds_axis(per_velocity: float) -> Paint:
    def scaled(factor: float) -> Callable[[ArrayLike], ArrayLike]:
        return lambda values: np.asarray(values, dtype=np.float64) * factor

    def paint(axes: Axes) -> None:
        top = axes.secondary_xaxis("top", functions=(scaled(per_velocity), scaled(1 / per_velocity)))
        top.set_xlabel("Reynolds number", color=MUTED)
        top.xaxis.set_major_formatter(FuncFormatter(decade))
        top.xaxis.set_minor_locator(NullLocator())

    return paint


def _law(_own: Record, evidence: Record) -> Record:
    law = evidence["flow_law"]
    return {"laws": [_flow_law(law, row) for row in range(len(law["gas_pressure_Pa"]))]}


def _flow_law(law: Record, row: int) -> Drawing:
    """Velocity over fill ratio at one gas pressure: the calibrated law with its regimes against Eq. 19."""
    fill = np.asarray(law["fill_ratio"])
    velocity, width = (np.asarray(law[key][row]) for key in ("velocity_m_s", "velocity_uncertainty"))
    parts = list(stretches(list(law["regime"][row])))
    first = dict(reversed(parts))
    return draw(
        f"flow-law-{row}",
        curve(fill, law["velocity_paper_m_s"][row], "Eq. 19", **AS_PAPER),
        curve(fill, velocity, band=width, color=FOUND, linewidth=0),
        *(
            curve(
                fill[part],
                velocity[part],
                f"calibrated, {regime}" if first[regime] == part else None,
                color=FOUND,
                **_REGIME_LINES[regime],
            )
            for regime, part in parts
        ),
        x=("fill ratio of the driven chamber", "1"),
        y=("velocity in the tube", "m/s"),
        ylim=(0, None),
        columns=3,
    )


_POINTS: Final = 161
_SHARES: Final = np.linspace(0.06, 0.94, 23)
"""Fills at which a regime is looked for, as shares of the largest."""
_FACTORS: Final = (1.0, 0.6, 0.3, 1.5, 2.0)
"""Gas pressures at which it is looked for, over the scene's."""
_ORDER: Final = (Regime.SIPHON, Regime.SEPARATED, Regime.BLOCKED, Regime.REVERSE)


def _collect(work: Work) -> Record | None:
    """One operating state of every regime that this tube can be in, with its pressures along the path."""
    law = work.calibration.flow_law
    if work.ring.tube.hump_radius is None:
        return None
    found = [(regime, _state_in(regime, work.ring, law)) for regime in _ORDER]
    return {
        "hump_radius_m": work.ring.tube.hump_radius,
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
        "column": _column_code(found.cavitation_margin, found.cavitation_margin_uncertainty),
    }


def _column_code(margin: float | None, width: float | None) -> str:
    """What a full column does, by its margin and half-width, Pa: none, undecided, holds or separates."""
    if margin is None:
        return "none"
    if width is not None and abs(margin) <= width:
        return "undecided"
    return "holds" if margin > 0 else "separates"


def _crest(found: Record, _evidence: Record) -> Record | None:
    return {"figure": _path_figure(found["states"])} if found["states"] else None


def _path_figure(states: list[Record]) -> Drawing:
    """Gauge pressure along the path, one line a regime, dotted where the tube is not full."""
    first = states[0]
    crest, cavity, length = first["hump_path_m"], first["cavity_pressure_Pa"], first["path_m"][-1]
    pressures = [value for state in states for value in (*state["pressure_Pa"], cavity)]
    low, high = min(pressures), max(pressures)
    bottom, top = low - 0.09 * (high - low), high + 0.05 * (high - low)
    return draw(
        "hump-pressure",
        *(part for state in states for part in _path(state)),
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


def _path(state: Record) -> list[Paint]:
    path, pressure = np.asarray(state["path_m"]), np.asarray(state["pressure_Pa"])
    label: str | None = f"{state['regime']}, {given(state['gas_pressure_Pa'], 'Pa', digits=3)}"
    parts = []
    for full, part in stretches(state["full"]):
        look = {"color": REGIME_COLOURS[state["regime"]], "linestyle": "-" if full else (0, (1, 2))}
        parts.append(curve(path[part], pressure[part], label if full else None, **look))
        label = None if full else label
    return parts


TUBE: Final = Section(name="tube", title="The connecting tube", show=_tube)
LAW: Final = Section(name="law", title="The flow law", show=_law)
CREST: Final = Section(name="hump", title="Pressure over the siphon crest", collect=_collect, show=_crest)
