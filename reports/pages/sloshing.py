"""Waves on the ring: natural frequencies over the speed, the swing under gravity, and the fills to avoid."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.mesh.section import NoPlaneWavesError
from ringbalance.physics.sloshing.modes import resonant_fills, sloshing_modes
from ringbalance.physics.sloshing.range import FREQUENCY_UNCERTAINTY, HIGHEST_TRUE, LOWEST_TRUE
from ringbalance.physics.sloshing.response import sloshing_response
from ringbalance.reports.figures import style
from ringbalance.reports.figures.style import Drawing, draw
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.numbers import number, percent, short, shown
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
    return {
        "fill_ratio": fills[:-1].tolist(),
        "frequency_ratio": modes.frequency_ratio.value.T.tolist(),
        "frequency_ratio_uncertainty": modes.frequency_ratio.uncertainty.T.tolist(),
        "amplification": answer.amplification.value[:-1].tolist(),
        "amplification_interval": answer.amplification_interval[:-1].tolist(),
        "pressure_amplification": answer.pressure_amplification.value[:-1].tolist(),
        "pressure_amplification_interval": answer.pressure_amplification_interval[:-1].tolist(),
        "surface_amplitude_m": answer.surface_amplitude.value[:-1].tolist(),
        "largest_surface_amplitude_m": answer.surface_amplitude_interval[:-1, 1].tolist(),
        "depth_m": (scene.disc.outer_radius - answer.surface_radius[:-1]).tolist(),
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
    """Sentences and figures."""
    if "left_out" in found:
        text = found["left_out"]
        return {"findings": [f"{text[0].upper()}{text[1:]}."]}
    return {
        "findings": [_equal(found), _avoid(found), *_reservation(found)],
        "frequencies": _frequencies(found),
        "swing": _swing(found),
    }


def _equal(found: Record) -> str:
    equal = found["equal"]
    moment, pressure = (_with_ends(equal, key) for key in ("amplification", "pressure_amplification"))
    return (
        f"At equal fills gravity swings a chamber’s moment {moment} times as much as a surface that followed "
        f"at once would, and the wall pressure {pressure} times: the Coriolis force on the "
        "liquid that runs along the wall presses on it, however thin the ring. "
        f"The surface moves by {shown(equal['surface_amplitude_m'], 'm', digits=2)} each way, once a turn. "
        f"Gravity is {number(equal['tilt_ratio'], digits=2)} of the centrifugal acceleration there."
    )


def _with_ends(equal: Record, key: str) -> str:
    """Such as "0.79 (0.63 to 1.0)", by what natural frequencies may be."""
    ends = " to ".join(short(end, digits=2) for end in equal[f"{key}_interval"])
    return f"{short(equal[key], digits=2)} ({ends})"


def _avoid(found: Record) -> str:
    fills, top = np.asarray(found["fill_ratio"]), found["frequency_ratio"][0][-1]
    # Even modes of a sector hardly feel gravity, which pulls the whole chamber one way.
    strong = [mode for mode in _meeting(found) if found["imported"] or mode % 2]
    if not strong and abs(top - 1) > _NEAR:
        return f"No mode that gravity can drive meets the speed up to a fill ratio of {short(fills[-1])}."
    told = [f"{' to '.join(_within(found, mode))} (mode {mode})" for mode in strong]
    near = (
        [f"from about {short(_nearing(found), digits=2)} up, where the first mode comes near the speed"]
        if abs(top - 1) <= _NEAR
        else []
    )
    return (
        f"Fills to pass quickly, at any speed: {', '.join([*told, *near])}; natural frequencies count as "
        f"known to {percent(FREQUENCY_UNCERTAINTY)}, as measured ones differ."
    )


def _meeting(found: Record) -> list[int]:
    """Modes that meet the speed, or may meet it for what their frequencies may be."""
    met = {item["mode"] for item in found["resonant"]}
    low, high = _MEETING
    ratios = enumerate(found["frequency_ratio"], start=1)
    return sorted(met | {mode for mode, s in ratios if s[0] < high and s[-1] > low})


def _within(found: Record, mode: int) -> list[str]:
    """Fills between which a mode may meet the speed."""
    ends = np.interp(_MEETING, found["frequency_ratio"][mode - 1], found["fill_ratio"])
    return [short(float(end), digits=2) for end in ends]


def _nearing(found: Record) -> float:
    """Fill from which the swing is more than twice that of a surface that follows at once."""
    fills, swing = np.asarray(found["fill_ratio"]), np.asarray(found["amplification"])
    high = np.flatnonzero(swing < 2)
    return float(fills[min(int(high[-1]) + 1, fills.size - 1)]) if high.size else float(fills[0])


def _reservation(found: Record) -> list[str]:
    if found["status"]["code"] == "ok":
        share = max(np.asarray(found["largest_surface_amplitude_m"]) / np.asarray(found["depth_m"]))
        return [f"The waves stay within {percent(share, digits=2)} of the ring’s depth: small, as assumed."]
    return [found["status"]["text"][0].upper() + found["status"]["text"][1:] + "."]


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
        caption="Natural frequencies of the liquid in a chamber, seen in the disc, over the speed: the "
        "lowest four modes. They scale with the speed, so a fill where one is 1 is resonant at every speed.",
    )


def _quiet(found: Record) -> str:
    """Which modes count for little."""
    if found["imported"]:
        return (
            "; solved in the chamber’s middle section: waves along the shaft, which gravity hardly drives, "
            "and a section that changes along it are left out, and a peak between two points may be missed"
        )
    return "; even modes hardly feel gravity"


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
        caption="What inertia and Coriolis force make of gravity’s pull, over a surface that follows at "
        f"once. Dotted: fills at which a mode meets the speed{_quiet(found)}.",
    )


SECTION: Final = Section(name="sloshing", title="Waves on the ring", collect=_collect, apart=True, show=_view)
