"""The three things that Eqs. 13 to 18 take for granted: one k, '+1', and a tube that runs full."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.scene.models import Scene
from ringbalance.verification.comparison import from_half_width
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure
from ringbalance.verification.loops import flow_law_of
from ringbalance.verification.paper_numbers import fig_7_readings
from ringbalance.verification.reference.tube_running import driving_head, running_tube, running_tubes

_PRESSURES: Final = np.geomspace(0.77, 2.53, 9)
"""In units of the scene's."""
_FILLS: Final = np.linspace(0.02, 1.0, 50)
"""In units of the largest."""


def values(scene: Scene) -> dict[str, float]:
    return {"siphon_share": _siphon_share(scene), "one_k": _one_k(scene).value}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    excess, by_exit = _exit(scene)
    _, bare = fig_7_readings()
    return Evidence(
        found={
            "one_k": _one_k(scene),
            "exit_velocity": Found(value=by_exit),
            "siphon_share": Found(value=_siphon_share(scene)),
        },
        numbers={
            "exit_excess": excess,
            "bare_bore": bare.tube.bore,
            "share_bare": _siphon_share(bare),
        },
        series=(_figure(scene),),
    )


def _one_k(scene: Scene) -> Found:
    """k's own uncertainty is common to all velocities, so it only scales the difference."""
    heads = tuple(driving_head(scene, share=share) for share in (0.5, 0.0, 0.25, 0.75, 1.0))
    middle, *others = running_tubes(scene, heads)
    errors = [
        abs(math.sqrt(2 * head / (middle.k + 1)) / other.velocity - 1)
        for head, other in zip(heads[1:], others, strict=True)
    ]
    worst = max(errors)
    return Found(value=worst, input=from_half_width(worst * middle.half_width / (middle.k + 1)))


def _exit(scene: Scene) -> tuple[float, float]:
    """Exit loss beyond '+1', and half its share of k + 1: its effect on the velocity."""
    own = running_tube(scene, head=driving_head(scene, share=0.5))
    return own.exit_loss, abs(own.exit_loss) / (2 * (own.k + 1))


def _siphon_share(scene: Scene) -> float:
    law = flow_law_of(scene)
    flow = law.evaluate(
        fill_ratio=_FILLS[:, None] * law.max_fill_ratio,
        gas_pressure=_PRESSURES[None, :] * scene.gas.pressure,
        primed=False,
    )
    return float(np.mean(flow.regime == Regime.SIPHON))


def _figure(scene: Scene) -> Series:
    law = flow_law_of(scene)
    fills = _FILLS * law.max_fill_ratio
    flow = law.evaluate(fill_ratio=fills, gas_pressure=scene.gas.pressure, primed=False)
    middle = running_tube(scene, head=driving_head(scene, share=0.5))
    one_k = [math.sqrt(2 * driving_head(scene, share=float(s)) / (middle.k + 1)) for s in _FILLS]
    return figure(
        "velocity at the scene's gas pressure",
        ("fill ratio", "1", fills),
        Curve("calibrated law", "m/s", flow.velocity, uncertainty=flow.uncertainty),
        Curve("Eq. 14 with one k", "m/s", np.array(one_k), style="paper"),
    )
