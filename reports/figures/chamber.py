"""Figures of the liquid at rest: pressure along the radius, moment and lambda."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.numbers import percent, short, shown
from ringbalance.reports.section import Record


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

    found, printed = shown(profile["pressure_Pa"][-1], "Pa"), shown(profile["paper_pressure_Pa"][-1], "Pa")
    fill = short(profile["fill_ratio"])
    return draw(
        x="radius in mm",
        y="gauge pressure in MPa",
        name="pressure-profile",
        paint=paint,
        alt=f"Pressure rises from the free surface to the outer wall: {found} found, {printed} by Eq. 12.",
        caption=f"Liquid pressure along the middle of a chamber at a fill ratio of {fill}. At the wall: "
        f"{found} by finite elements, {printed} by Eq. 12.",
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

    most, printed = shown(chamber["moment_kg_m"][-1], "kg m"), shown(chamber["moment_paper_kg_m"][-1], "kg m")
    return draw(
        x="fill ratio",
        y="moment of one chamber in g mm",
        name="moment",
        paint=paint,
        alt=f"The moment of a chamber grows with its fill to {most}; Eq. 7 gives {printed}.",
        caption=f"Balancing moment of one chamber. At the largest fill: {most} found, {printed} by Eq. 7.",
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

    centre = shown(summary["per_transferred_mass_m"], "m", total)
    varies = percent(summary["variation_over_range"])
    return draw(
        x="fill ratio of the driven chamber",
        y="λ per transferred mass in mm",
        name="lambda",
        paint=paint,
        alt=f"Lambda is {centre} at the centre and varies by {varies} over the fill range.",
        caption=f"λ = {centre} at the centre; over the fill range it varies by {varies} of that.",
    )
