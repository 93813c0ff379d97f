"""Tuning of eccentric masses: the sampled loops of their drives, as `recommended_gains` judges them."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.scene.eccentric_models import EccentricScene


def _eccentric_status(gains: RecommendedGains) -> str:
    """Whether the scene's loops are stable and have their margin, and what to change."""
    unstable = ", ".join(loop.name for loop in gains.loops if not loop.stable)
    high = [loop for loop in gains.loops if loop.value > loop.recommended]
    if not unstable and not high:
        return "tuned: every loop of the drives is stable with a gain margin of two"
    found = f"unstable: {unstable}" if unstable else "a gain margin is below two"
    changes = ", ".join(f"{loop.key} to {loop.recommended:.4g} {loop.unit}".rstrip() for loop in high)
    cure = f"lower {changes}, or hold" if changes else "hold"
    return f"{found}: {cure} the voltage for at most {gains.step:.4g} s"


def eccentric_tuning_document(scene: EccentricScene, gains: RecommendedGains) -> dict[str, Any]:
    """The loops of a scene's drives as a JSON document in SI."""
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": scene.balancer,
        "status": _eccentric_status(gains),
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


def show_eccentric_tuning(gains: RecommendedGains, console: Console) -> None:
    """Print the loops of a scene's drives."""
    stable = all(loop.stable for loop in gains.loops)
    console.print(Text(_eccentric_status(gains), style=f"bold {'green' if stable else 'yellow'}"))
    table = Table()
    for name in (
        "loop",
        "key",
        "value",
        "recommended, at most",
        "unit",
        "largest pole",
        "voltage hold, at most",
    ):
        table.add_column(name)
    for loop in gains.loops:
        table.add_row(
            loop.name,
            loop.key,
            f"{loop.value:.4g}",
            f"{loop.recommended:.4g}",
            loop.unit,
            f"{loop.radius:.4f}",
            f"{loop.recommended_step:.4g} s",
        )
    console.print(table)
