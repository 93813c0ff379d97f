"""Figures of a calibration: the liquid at rest in a chamber, k of the tube, and the flow law."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullLocator

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record
from ringbalance.results.numbers import given
from ringbalance.scene.arrays import FloatArray, stretches

_VELOCITY_TICKS: Final = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0]
_REGIME_LINES: Final[dict[str, Record]] = {
    "siphon": {"linestyle": "-"},
    "separated": {"linestyle": "-", "marker": "o", "markersize": 3.2, "markevery": 5},
    "blocked": {"linestyle": ":"},
    "reverse": {"linestyle": "-."},
    "cannot be told": {"linestyle": "-", "marker": "x", "markersize": 3.2, "markevery": 5},
}


def chamber_figures(evidence: Record) -> dict[str, Drawing]:
    """By the names that the templates have for them."""
    calibration = evidence["calibration"]
    return {
        "pressure_profile": _pressure_profile(evidence["pressure"]["profile"]),
        "moment": _moment(calibration["chamber"]),
        "transfer_lambda": _transfer_lambda(calibration["chamber"], calibration["lambda"], evidence["paper"]),
    }


def _pressure_profile(profile: Record) -> Drawing:
    """Pressure from the free surface to the wall: finite elements against what Eq. 12 implies.

    p(r) = rho omega^2 (r^2 - a^2)/2; Eq. 12 has the same form with the surface a of a chamber without plates.
    """
    radius = np.asarray(profile["radius_m"]) * 1e3
    pressure = np.asarray(profile["pressure_Pa"]) * 1e-6
    paper_radius = np.asarray(profile["paper_radius_m"]) * 1e3
    paper = np.asarray(profile["paper_pressure_Pa"]) * 1e-6

    def paint(axes: Axes) -> None:
        axes.plot(radius, pressure, color=style.FOUND, marker="o", markersize=3, label="finite elements")
        axes.plot(paper_radius, paper, **style.AS_PAPER, label="as Eq. 12 implies")
        axes.axvline(radius[0], color=style.MUTED, linewidth=0.8, linestyle=":")
        axes.annotate(
            "free surface",
            (radius[0], pressure.max() * 0.98),
            xytext=(4, 0),
            textcoords="offset points",
            color=style.MUTED,
            va="top",
        )
        axes.set_xlim(right=radius[-1])
        axes.set_ylim(bottom=0)

    return draw(
        x="radius in mm",
        y="gauge pressure in MPa",
        name="pressure-profile",
        paint=paint,
        alt="Pressure rises from the free surface to the outer wall, more than Eq. 12 has it.",
    )


def _moment(chamber: Record) -> Drawing:
    """Balancing moment of one chamber over its fill, with and without the plates."""
    fill = chamber["fill_ratio"]
    found = np.asarray(chamber["moment_kg_m"]) * 1e6
    band = np.asarray(chamber["moment_uncertainty"]) * 1e6
    paper = np.asarray(chamber["moment_paper_kg_m"]) * 1e6

    def paint(axes: Axes) -> None:
        style.band(axes, fill, found, band, style.FOUND)
        axes.plot(fill, found, color=style.FOUND, marker="o", markersize=3, label="finite elements")
        axes.plot(fill, paper, **style.AS_PAPER, label="Eq. 7, plates left out")
        axes.set_ylim(bottom=0)

    return draw(
        x="fill ratio",
        y="moment of one chamber in g mm",
        name="moment",
        paint=paint,
        alt="The moment of a chamber grows with its fill, less than by Eq. 7.",
    )


def _transfer_lambda(chamber: Record, summary: Record, paper: Record) -> Drawing:
    """Lambda per transferred mass over the fill, with the paper's value and its spread."""
    fill = chamber["fill_ratio"]
    found = np.asarray(chamber["lambda_per_transferred_mass_m"]) * 1e3
    printed, spread = paper["lambda_m"] * 1e3, paper["lambda_spread"]
    total = math.hypot(summary["uncertainty_m"], summary["input_uncertainty_m"])
    half_width = total * 1e3

    def paint(axes: Axes) -> None:
        axes.axhspan(
            printed * (1 - spread), printed * (1 + spread), color=style.PAPER, alpha=0.14, linewidth=0
        )
        axes.axhline(printed, **style.AS_PAPER, label="the paper, with its spread")
        style.band(axes, fill, found, half_width, style.FOUND)
        axes.plot(fill, found, color=style.FOUND, marker="o", markersize=3, label="finite elements")

    return draw(
        x="fill ratio of the driven chamber",
        y="λ per transferred mass in mm",
        name="lambda",
        paint=paint,
        alt="Lambda at the centre and over the fill range, beside the paper’s number.",
    )


def tube_figures(evidence: Record) -> Record:
    """By the names that the templates have for them."""
    tube, law = evidence["calibration"]["tube"], evidence["flow_law"]
    return {
        "drag": _drag(tube, evidence["operating_point"], evidence["paper"]),
        "drag_terms": _drag_terms(tube),
        "flow_laws": [_flow_law(law, row) for row in range(len(law["gas_pressure_Pa"]))],
    }


def _nice_ticks(low: float, high: float) -> list[float]:
    """1-2-5 ticks of a logarithmic axis of a few decades, decades alone beyond three."""
    steps = (1, 2, 5) if high / low < 1e3 else (1,)
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    ticks = [step * 10.0**exponent for exponent in decades for step in steps]
    return [tick for tick in ticks if low <= tick <= high]


def _shade_transition(axes: Axes, velocity: FloatArray, states: list[str]) -> None:
    """Grey where the flow is neither laminar nor turbulent."""
    for state, part in stretches(states):
        if state == "transitional":
            ends = velocity[part.start], velocity[part.stop - 1]
            axes.axvspan(*ends, color=style.MUTED, alpha=0.13, linewidth=0, label=state)


def _reynolds_axis(axes: Axes, reynolds_per_velocity: float) -> None:
    def to_reynolds(velocity: npt.ArrayLike) -> FloatArray:
        return np.asarray(velocity, dtype=np.float64) * reynolds_per_velocity

    def to_velocity(reynolds: npt.ArrayLike) -> FloatArray:
        return np.asarray(reynolds, dtype=np.float64) / reynolds_per_velocity

    top = axes.secondary_xaxis("top", functions=(to_reynolds, to_velocity))
    top.set_xlabel("Reynolds number", color=style.MUTED)
    top.xaxis.set_major_formatter(FuncFormatter(style.decade))
    top.xaxis.set_minor_locator(NullLocator())


def _drag(tube: Record, point: Record, paper: Record) -> Drawing:
    """k against velocity and Reynolds number, with its 95 % band and the paper's one number."""
    velocity, k = np.asarray(tube["velocity_m_s"]), np.asarray(tube["k"])
    band = np.asarray(tube["k_uncertainty"])
    low, high = np.maximum(k - band, k.min() * 0.2), k + band
    printed = paper["drag_coefficient"]

    def paint(axes: Axes) -> None:
        style.logarithmic(axes, "x", ticks=_VELOCITY_TICKS)
        axes.set_xlim(velocity[0], velocity[-1])
        _shade_transition(axes, velocity, tube["flow_state"])
        axes.axhline(printed, **style.AS_PAPER, label="the paper")
        axes.fill_between(velocity, low, high, color=style.FOUND, alpha=0.2, linewidth=0)
        axes.plot(velocity, k, color=style.FOUND, label="found, 95 % band")
        if point["k"] is not None:
            place = [point["k_at_velocity_m_s"]], [point["k"]]
            axes.plot(*place, "o", color=style.INK, markersize=4.5, label="operating point")
        bottom, ceiling = min(low.min(), printed) * 0.8, max(high.max(), printed) * 1.3
        style.logarithmic(axes, "y", ticks=_nice_ticks(bottom, ceiling))
        axes.set_ylim(bottom, ceiling)
        _reynolds_axis(axes, tube["reynolds"][-1] / tube["velocity_m_s"][-1])

    return draw(
        columns=4,
        x="mean velocity in the tube in m/s",
        y="drag coefficient k",
        name="drag",
        paint=paint,
        wide=True,
        height=3.9,
        alt="The drag coefficient over velocity, with its band, beside the paper’s one number.",
    )


def _drag_terms(tube: Record) -> Drawing:
    """What k is made of, term by term, over velocity."""
    velocity = np.asarray(tube["velocity_m_s"])
    terms = {name: np.asarray(values) for name, values in tube["terms"].items() if np.any(values)}
    largest = max(np.abs(values).max() for values in terms.values())
    shown_terms = {name: v for name, v in terms.items() if np.abs(v).max() > 1e-3 * largest}

    def paint(axes: Axes) -> None:
        style.logarithmic(axes, "x", ticks=_VELOCITY_TICKS)
        for index, (name, values) in enumerate(shown_terms.items()):
            positive, label = np.where(values > 0, values, np.nan), name.replace("_", " ")
            axes.plot(velocity, positive, label=label, **style.line(index))
        style.logarithmic(axes, "y")
        axes.set_xlim(velocity[0], velocity[-1])

    names = ", ".join(name.replace("_", " ") for name in shown_terms)
    return draw(
        columns=3,
        x="mean velocity in the tube in m/s",
        y="contribution to k",
        name="drag-terms",
        paint=paint,
        alt=f"Contributions to the drag coefficient over velocity: {names}.",
    )


def _flow_law(law: Record, row: int) -> Drawing:
    """Velocity over fill ratio at one gas pressure: the calibrated law with its regimes against Eq. 19."""
    fill = np.asarray(law["fill_ratio"])
    velocity, paper = np.asarray(law["velocity_m_s"][row]), np.asarray(law["velocity_paper_m_s"][row])
    band, regimes = np.asarray(law["velocity_uncertainty"][row]), list(law["regime"][row])

    def paint(axes: Axes) -> None:
        axes.plot(fill, paper, **style.AS_PAPER, label="Eq. 19")
        axes.fill_between(
            fill, np.maximum(velocity - band, 0), velocity + band, color=style.FOUND, alpha=0.2, linewidth=0
        )
        named: set[str] = set()
        for regime, part in stretches(regimes):
            label = None if regime in named else f"calibrated, {regime}"
            axes.plot(fill[part], velocity[part], color=style.FOUND, label=label, **_REGIME_LINES[regime])
            named.add(regime)
        axes.set_ylim(bottom=0)

    pressure = given(law["gas_pressure_Pa"][row], "Pa")
    names = " and ".join(dict.fromkeys(regimes))
    return draw(
        columns=3,
        x="fill ratio of the driven chamber",
        y="velocity in the tube in m/s",
        name=f"flow-law-{row}",
        paint=paint,
        alt=f"Velocity over fill ratio at {pressure}: calibrated ({names}), and by Eq. 19.",
    )
