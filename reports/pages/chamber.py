"""The liquid in a chamber: its pressure, moment and lambda, and the waves on its ring under gravity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.mesh.section import NoPlaneWavesError
from ringbalance.physics.sloshing import (
    FREQUENCY_UNCERTAINTY,
    HIGHEST_TRUE,
    LOWEST_TRUE,
    resonant_fills,
    sloshing_modes,
    sloshing_response,
)
from ringbalance.reports.figure import (
    AS_PAPER,
    FOUND,
    MUTED,
    PAPER,
    THIRD,
    AxisLabel,
    Drawing,
    Paint,
    curve,
    draw,
    level,
    logarithmic,
    note,
    upright,
)
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.traced import budgets_of, total_of
from ringbalance.scene.arrays import FloatArray

_DOTS: Final[Record] = {"color": FOUND, "marker": "o", "markersize": 3}
_FILL: Final[AxisLabel] = ("fill ratio", "1")
_MODES: Final = 4
_FILLS: Final = 17
_IMPORTED_FILLS: Final = 9
"""Number of fills of an imported chamber: each fill cuts its mesh twice."""
_COARSE: Final = ((8, 24), (4, 12), (2, 6))
"""Cells of meshes, accurate to the three digits that figures and sentences need."""
_NEAR_SPEED: Final = 0.15
"""Distance of a frequency from the speed, over the speed, within which the fill is to be avoided."""
_RESONANT_RATIOS: Final = (1 / HIGHEST_TRUE, 1 / LOWEST_TRUE)
"""Range of frequencies over the speed, by theory, that may be resonant."""


def _pressure(record: Record, _evidence: Record) -> Record:
    """Pressure from the free surface to the wall: finite elements against what Eq. 12 implies.

    p(r) = rho omega^2 (r^2 - a^2)/2; Eq. 12 has the same form with the surface a of a chamber without plates.
    """
    profile = record["profile"]
    radius, pressure = profile["radius_m"], profile["pressure_Pa"]
    figure = draw(
        "pressure-profile",
        curve(radius, pressure, "finite elements", **_DOTS),
        curve(profile["paper_radius_m"], profile["paper_pressure_Pa"], "as Eq. 12 implies", **AS_PAPER),
        upright(radius[0], color=MUTED, linewidth=0.8, linestyle=":"),
        note("free surface", (radius[0], 0.98 * max(pressure)), (4, 0), va="top"),
        x=("radius", "m"),
        y=("gauge pressure", "Pa"),
        xlim=(None, radius[-1]),
        ylim=(0, None),
    )
    return {"profile": figure}


def _moment(_own: Record, evidence: Record) -> Record:
    """Balancing moment of one chamber, and lambda per transferred mass, with the paper's."""
    calibration, paper = evidence["calibration"], evidence["paper"]
    chamber = calibration["chamber"]
    fill, moments, printed = chamber["fill_ratio"], chamber["moment_kg_m"], paper["lambda_m"]
    spread = printed * paper["lambda_spread"]
    moment = draw(
        "moment",
        curve(fill, moments, "finite elements", band=chamber["moment_uncertainty"], **_DOTS),
        curve(fill, chamber["moment_paper_kg_m"], "Eq. 7, plates left out", **AS_PAPER),
        x=_FILL,
        y=("moment of one chamber", "kg m"),
        ylim=(0, None),
    )
    arm = draw(
        "lambda",
        lambda axes: axes.axhspan(printed - spread, printed + spread, color=PAPER, alpha=0.14, linewidth=0),
        level(printed, "the paper, with its spread", **AS_PAPER),
        curve(
            fill,
            chamber["lambda_per_transferred_mass_m"],
            "finite elements",
            band=total_of(budgets_of(evidence)["lambda"]),
            **_DOTS,
        ),
        x=("fill ratio of the driven chamber", "1"),
        y=("λ per transferred mass", "m"),
    )
    return {"moment": moment, "arm": arm}


def _collect(work: Work) -> Record | None:
    """Natural frequencies and swing of the liquid over the fill; None where gravity drives no waves."""
    scene = work.ring
    if scene.environment.shaft == "vertical" or scene.environment.gravity == 0:
        return None
    largest, imported = scene.disc.max_fill_ratio, scene.disc.geometry is not None
    try:
        met = resonant_fills(disc=scene.disc, modes=_MODES)
        if imported:
            # Denser for thin rings, whose frequencies rise fastest.
            fills = (0.02 + 0.98 * np.linspace(0, 1, _IMPORTED_FILLS) ** 2) * largest
        else:
            # A peak is narrower than the spacing of even points.
            peaks = [
                x * side for _, x in met for side in (0.96, 0.99, 1.0, 1.01, 1.04) if x * side <= largest
            ]
            fills = np.unique([*(np.linspace(0.02, 1.0, _FILLS) * largest), *peaks])
        modes = sloshing_modes(disc=scene.disc, fill_ratio=fills, modes=_MODES, cells=_COARSE)
        answer = sloshing_response(
            disc=scene.disc,
            fill_ratio=np.append(fills, scene.disc.initial_fill),
            angular_velocity=abs(scene.rotor.speed),
            kinematic_viscosity=scene.liquid.kinematic_viscosity,
            gravity=scene.environment.gravity,
            cells=_COARSE,
        )
    except NoPlaneWavesError as error:
        return {"left_out": str(error)}
    ratios, swing = modes.frequency_ratio.value.T, answer.amplification.value[:-1]
    depth = scene.disc.outer_radius - answer.surface_radius[:-1]
    near = abs(ratios[0][-1] - 1) <= _NEAR_SPEED
    results = {
        "amplification": answer.amplification.value,
        "amplification_interval": answer.amplification_interval,
        "pressure_amplification": answer.pressure_amplification.value,
        "pressure_amplification_interval": answer.pressure_amplification_interval,
        "surface_amplitude_m": answer.surface_amplitude.value,
    }
    tilt = scene.environment.gravity / (scene.rotor.speed**2 * answer.surface_radius[-1])
    return {
        "fill_ratio": fills.tolist(),
        "avoid": _to_avoid(ratios, fills, [mode for mode, _ in met], imported=imported),
        "near_from_fill_ratio": _nearing(fills, swing) if near else None,
        "frequency_uncertainty": FREQUENCY_UNCERTAINTY,
        "largest_wave_over_depth": float(np.max(answer.surface_amplitude_interval[:-1, 1] / depth)),
        "frequency_ratio": ratios.tolist(),
        **{name: values[:-1].tolist() for name, values in results.items()},
        "imported": imported,
        "resonant": [{"mode": mode, "fill_ratio": x} for mode, x in met],
        "equal": {
            "fill_ratio": scene.disc.initial_fill,
            **{name: values[-1].tolist() for name, values in results.items()},
            "tilt_ratio": float(tilt),
        },
        "status": {"code": str(answer.status.code), "text": answer.status.text},
    }


def _view(waves: Record, _evidence: Record) -> Record:
    return {} if "left_out" in waves else {"frequencies": _frequencies(waves), "swing": _swing(waves)}


def _to_avoid(ratios: FloatArray, fills: FloatArray, met: Sequence[int], *, imported: bool) -> list[Record]:
    """Ranges of the fill in which a gravity-driven mode may be resonant, with its uncertain frequency.

    Gravity hardly excites even modes of a sector, since it acts in one direction on the whole chamber.
    Args: `ratios`: frequencies over the speed, a row per mode. `met`: modes resonant at some fill by theory.
    """
    low, high = _RESONANT_RATIOS
    within = [
        mode
        for mode, row in enumerate(ratios, start=1)
        if (mode in met or (row[0] < high and row[-1] > low)) and (imported or mode % 2)
    ]
    # On a thin ring the square of a frequency grows with the depth, so a straight line meets it best.
    ends = {mode: np.interp(np.square(_RESONANT_RATIOS), ratios[mode - 1] ** 2, fills) for mode in within}
    return [{"mode": mode, "from_fill_ratio": a, "to_fill_ratio": b} for mode, (a, b) in ends.items()]


def _nearing(fills: FloatArray, swing: FloatArray) -> float:
    """Fill from which the swing is more than twice that of a surface in equilibrium."""
    quiet = np.flatnonzero(swing < 2)
    return float(fills[min(int(quiet[-1]) + 1, fills.size - 1)]) if quiet.size else float(fills[0])


def _frequencies(waves: Record) -> Drawing:
    fills, met = waves["fill_ratio"], [item["fill_ratio"] for item in waves["resonant"]]
    modes: list[Paint] = []
    for index, ratios in enumerate(waves["frequency_ratio"]):
        label = None if index else "natural frequencies"
        modes.append(curve(fills, ratios, label, color=FOUND, linewidth=1.6 - 0.25 * index))
        modes.append(note(f"{index + 1}", (fills[-1], ratios[-1]), (3, 0), color=FOUND, va="center"))
    return draw(
        "sloshing-frequencies",
        *modes,
        level(1.0, "gravity, once a turn", linewidth=1.2, **AS_PAPER),
        curve(met, [1.0] * len(met), color=PAPER, linestyle="", marker="o", markersize=4),
        x=_FILL,
        y=("frequency over speed", "1"),
        xlim=(0, 1.05 * fills[-1]),
        ylim=(0, None),
    )


def _swing(waves: Record) -> Drawing:
    fills, moment, pressure = (
        waves[key] for key in ("fill_ratio", "amplification", "pressure_amplification")
    )
    points = {"marker": "o" if waves["imported"] else "", "markersize": 3}
    return draw(
        "sloshing-swing",
        curve(fills, moment, "moment", color=FOUND, **points),
        curve(fills, pressure, "wall pressure", color=THIRD, **points),
        level(1.0, "surface follows at once", color=MUTED, linewidth=1.2, linestyle=(0, (5, 2))),
        *(
            upright(each["fill_ratio"], color=MUTED, linewidth=0.8, linestyle=":")
            for each in waves["resonant"]
        ),
        logarithmic("y", within=(1e-3, 5e3)),
        x=_FILL,
        y=("swing", "1"),
        xlim=(0, 1.05 * fills[-1]),
        ylim=(0.7 * min(*moment, *pressure), 1.5 * max(*moment, *pressure, 1.0)),
    )


DISC: Final = Section(name="disc", title="The disc and its liquid")
PRESSURE: Final = Section(name="pressure", title="Pressure of the liquid", show=_pressure)
MOMENT: Final = Section(name="moment", title="Balancing moment and λ", show=_moment)
WAVES: Final = Section(name="sloshing", title="Waves on the ring", collect=_collect, show=_view)
