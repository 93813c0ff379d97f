"""Loops of the drives as information: their margins, for documents and tables."""

from __future__ import annotations

from typing import Any

from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.results.rows import Quantity


def loops_status(gains: RecommendedGains) -> str:
    """Whether every loop has its margin, and what to change."""
    unstable = ", ".join(loop.name for loop in gains.loops if not loop.stable)
    high = [loop for loop in gains.loops if loop.value > loop.recommended]
    if not unstable and not high:
        return "every loop of the drives is stable with a gain margin of two"
    problem = f"unstable: {unstable}" if unstable else "a gain margin is below two"
    changes = ", ".join(f"{loop.key} to {loop.recommended:.4g} {loop.unit}".rstrip() for loop in high)
    cure = f"lower {changes}, or hold" if changes else "hold"
    return f"{problem}: {cure} the voltage for at most {gains.step:.4g} s"


def loops_document(gains: RecommendedGains) -> dict[str, Any]:
    """For JSON, SI."""
    return {
        "loops_status": loops_status(gains),
        "gain": {loop.key: loop.recommended for loop in gains.loops},
        "loops": [
            {
                "name": loop.name,
                "key": loop.key,
                "value": loop.value,
                "unit": loop.unit,
                "poles": [[pole.real, pole.imag] for pole in loop.poles.tolist()],
                "radius": loop.radius,
                "stable": loop.stable,
                "gain_margin": loop.gain_margin,
                "recommended": loop.recommended,
                "recommended_step_s": loop.recommended_step,
            }
            for loop in gains.loops
        ],
        "step_s": gains.step,
        "drive_speed_rad_per_s": gains.drive_speed,
    }


def loops_quantities(gains: RecommendedGains) -> tuple[Quantity, ...]:
    """Largest values that leave a margin of two."""
    largest = (
        Quantity(key=loop.key, name=f"{loop.key}, at most", value=loop.recommended, unit=loop.unit or "1")
        for loop in gains.loops
    )
    return (*largest, Quantity(key="voltage_hold", name="voltage hold, at most", unit="s", value=gains.step))
