"""Waves on the ring: natural frequencies over the speed, the swing under gravity, and the fills to avoid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.mesh.section import NoPlaneWavesError
from ringbalance.physics.sloshing import (
    FREQUENCY_UNCERTAINTY,
    HIGHEST_TRUE,
    LOWEST_TRUE,
    resonant_fills,
    sloshing_modes,
    sloshing_response,
)
from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.numbers import short
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

_MODES: Final = 4
_POINTS: Final = 17
_COARSE: Final = ((8, 24), (4, 12), (2, 6))
"""Meshes for figures and sentences: three digits."""
_NEAR: Final = 0.15
"""Distance of a frequency from the speed, over the speed, that counts as a fill to avoid."""
_MEETING: Final = (1 / HIGHEST_TRUE, 1 / LOWEST_TRUE)
"""Frequencies over the speed, by theory, that may be the speed."""


def _collect(work: Work) -> Record | None:
    """Frequencies and swings over the fills, as plain numbers."""
    scene = work.scene
    if scene.environment.shaft == "vertical" or scene.environment.gravity == 0:
        return None
    try:
        return _waves(scene)
    except NoPlaneWavesError as error:
        return {"left_out": str(error)}


def _waves(scene: Scene) -> Record:
    largest = scene.disc.max_fill_ratio
    met = resonant_fills(disc=scene.disc, modes=_MODES)
    imported = scene.disc.geometry is not None
    # A peak is narrower than the distance of even points.
    peaks = [x * side for _, x in met for side in (0.96, 0.99, 1.0, 1.01, 1.04) if x * side <= largest]
    even = np.linspace(0.02, 1.0, _POINTS) * largest
    # Each fill of an imported chamber takes two cuts of its mesh.
    shown = even if imported else np.unique([*even, *peaks])
    fills = np.append(shown, scene.disc.initial_fill)
    modes = sloshing_modes(disc=scene.disc, fill_ratio=fills[:-1], modes=_MODES, cells=_COARSE)
    answer = sloshing_response(
        disc=scene.disc,
        fill_ratio=fills,
        angular_velocity=abs(scene.rotor.speed),
        kinematic_viscosity=scene.liquid.kinematic_viscosity,
        gravity=scene.environment.gravity,
        cells=_COARSE,
    )
    ratios, swing = modes.frequency_ratio.value.T, answer.amplification.value[:-1]
    depth = scene.disc.outer_radius - answer.surface_radius[:-1]
    near = abs(ratios[0][-1] - 1) <= _NEAR
    return {
        "fill_ratio": fills[:-1].tolist(),
        "avoid": to_avoid(ratios, fills[:-1], [mode for mode, _ in met], imported=imported),
        "near_from_fill_ratio": nearing(fills[:-1], swing) if near else None,
        "frequency_uncertainty": FREQUENCY_UNCERTAINTY,
        "largest_wave_over_depth": float(np.max(answer.surface_amplitude_interval[:-1, 1] / depth)),
        "frequency_ratio": ratios.tolist(),
        "frequency_ratio_uncertainty": modes.frequency_ratio.uncertainty.T.tolist(),
        "amplification": swing.tolist(),
        "amplification_interval": answer.amplification_interval[:-1].tolist(),
        "pressure_amplification": answer.pressure_amplification.value[:-1].tolist(),
        "pressure_amplification_interval": answer.pressure_amplification_interval[:-1].tolist(),
        "surface_amplitude_m": answer.surface_amplitude.value[:-1].tolist(),
        "largest_surface_amplitude_m": answer.surface_amplitude_interval[:-1, 1].tolist(),
        "depth_m": depth.tolist(),
        "imported": imported,
        "resonant": [{"mode": mode, "fill_ratio": x} for mode, x in met],
        "equal": {
            "fill_ratio": scene.disc.initial_fill,
            "amplification": float(answer.amplification.value[-1]),
            "amplification_interval": answer.amplification_interval[-1].tolist(),
            "pressure_amplification": float(answer.pressure_amplification.value[-1]),
            "pressure_amplification_interval": answer.pressure_amplification_interval[-1].tolist(),
            "surface_amplitude_m": float(answer.surface_amplitude.value[-1]),
            "tilt_ratio": float(
                scene.environment.gravity / (scene.rotor.speed**2 * answer.surface_radius[-1])
            ),
        },
        "status": {"code": str(answer.status.code), "text": answer.status.text},
    }


def _view(found: Record, _evidence: Record) -> Record:
    return {} if "left_out" in found else {"frequencies": _frequencies(found), "swing": _swing(found)}


def to_avoid(ratios: FloatArray, fills: FloatArray, met: Sequence[int], *, imported: bool) -> list[Record]:
    """Fills between which a mode that gravity drives meets the speed, for what its frequency may be.

    Even modes of a sector hardly feel gravity, which pulls the whole chamber one way.
    Args: `ratios`: frequencies over the speed, a row a mode. `met`: modes that meet the speed by theory.
    """
    low, high = _MEETING
    within = [
        mode
        for mode, row in enumerate(ratios, start=1)
        if (mode in met or (row[0] < high and row[-1] > low)) and (imported or mode % 2)
    ]
    ends = {mode: np.interp(_MEETING, ratios[mode - 1], fills) for mode in within}
    return [{"mode": mode, "from_fill_ratio": a, "to_fill_ratio": b} for mode, (a, b) in ends.items()]


def nearing(fills: FloatArray, swing: FloatArray) -> float:
    """Fill from which the swing is more than twice that of a surface that follows at once."""
    quiet = np.flatnonzero(swing < 2)
    return float(fills[min(int(quiet[-1]) + 1, fills.size - 1)]) if quiet.size else float(fills[0])


def _frequencies(found: Record) -> Drawing:
    fills = np.asarray(found["fill_ratio"])

    def paint(axes: Axes) -> None:
        for index, ratios in enumerate(found["frequency_ratio"]):
            label = "natural frequencies" if index == 0 else None
            axes.plot(fills, ratios, color=style.FOUND, linewidth=1.6 - 0.25 * index, label=label)
            axes.annotate(
                f"{index + 1}",
                (fills[-1], ratios[-1]),
                xytext=(3, 0),
                textcoords="offset points",
                color=style.FOUND,
                va="center",
            )
        axes.axhline(
            1.0, color=style.PAPER, linewidth=1.2, linestyle=(0, (5, 2)), label="gravity, once a turn"
        )
        for item in found["resonant"]:
            axes.plot(item["fill_ratio"], 1.0, "o", color=style.PAPER, markersize=4)
        axes.set_xlim(0, 1.05 * fills[-1])
        axes.set_ylim(bottom=0)

    met = ", ".join(f"mode {i['mode']} at {short(i['fill_ratio'], digits=2)}" for i in found["resonant"])
    return draw(
        x="fill ratio",
        y="frequency over speed",
        name="sloshing-frequencies",
        paint=paint,
        alt=f"Natural frequencies over the speed rise with the fill; they meet gravity's once a turn: {met}.",
    )


def _swing(found: Record) -> Drawing:
    fills = np.asarray(found["fill_ratio"])

    def paint(axes: Axes) -> None:
        marker = "o" if found["imported"] else ""
        lines: dict[str, Any] = {"marker": marker, "markersize": 3}
        axes.plot(fills, found["amplification"], color=style.FOUND, label="moment", **lines)
        axes.plot(fills, found["pressure_amplification"], color=style.THIRD, label="wall pressure", **lines)
        axes.axhline(
            1.0, color=style.MUTED, linewidth=1.2, linestyle=(0, (5, 2)), label="surface follows at once"
        )
        for item in found["resonant"]:
            axes.axvline(item["fill_ratio"], color=style.MUTED, linewidth=0.8, linestyle=":")
        style.logarithmic(axes, "y", within=(1e-3, 5e3))
        values = np.asarray([*found["amplification"], *found["pressure_amplification"]])
        axes.set_ylim(0.7 * values.min(), 1.5 * max(values.max(), 1.0))
        axes.set_xlim(0, 1.05 * fills[-1])

    return draw(
        x="fill ratio",
        y="swing",
        name="sloshing-swing",
        paint=paint,
        alt="Swing of a chamber's moment and of its wall pressure under gravity over those of a surface "
        "which follows gravity at once.",
    )


SECTION: Final = Section(name="sloshing", title="Waves on the ring", collect=_collect, apart=True, show=_view)
