"""The three things that Eqs. 13 to 18 take for granted: one k, '+1', and a tube that runs full.

The velocity is the one that a full tube takes by itself under a head, and k is taken there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.tube.heads import TubeHeads, velocity_of
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Curve, Evidence, Found, Level, Series, figure, from_half_width
from ringbalance.verification.loops import flow_law_of
from ringbalance.verification.paper_numbers import fig_7_readings
from ringbalance.verification.reference.exact_chamber import wall_pressure_of

_PRESSURES: Final = np.geomspace(0.77, 2.53, 9)
"""In units of the scene's."""
_FILLS: Final = np.linspace(0.02, 1.0, 50)
"""In units of the largest."""
_LEAST: Final = 0.05
"""Smallest head asked for, in units of the gas pressure's: below it lies a stall."""


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


@dataclass(frozen=True, kw_only=True)
class Running:
    """A full tube at its own velocity."""

    velocity: float
    """m/s."""
    k: float
    half_width: float
    """95 %, of k."""
    exit_loss: float
    """What a laminar exit adds to k."""
    reynolds: float
    flow_state: str


def running_tube(scene: Scene, *, head: float) -> Running:
    """The velocity with (k(u) + 1) u^2/2 = head, m^2/s^2, above zero."""
    return running_tubes(scene, (head,))[0]


@lru_cache(maxsize=64)
def running_tubes(scene: Scene, heads: tuple[float, ...]) -> tuple[Running, ...]:
    """The same under several heads at once."""
    head = np.array(heads)
    found = tube_loss(scene, velocity_of(table=TubeHeads.of(scene).head, head=head, where=head > 0))
    leaving = found.terms.get("exit", np.zeros(len(heads)))
    return tuple(
        Running(
            velocity=float(found.velocity[i]),
            k=float(found.k.value[i]),
            half_width=float(found.k.uncertainty[i]),
            exit_loss=float(leaving[i]),
            reynolds=float(found.reynolds[i]),
            flow_state=str(found.flow_state[i]),
        )
        for i in range(len(heads))
    )


def driving_head(scene: Scene, *, share: float) -> float:
    """Head between two chambers, H = [p0 + p_wall(x) - p_wall(x_max - x)]/rho, m^2/s^2.

    At least a twentieth of the gas pressure's own, short of a stall.
    Args: `share`: fill of the driven chamber in units of the largest.
    """
    fills = np.array([share, 1 - share]) * scene.disc.max_fill_ratio
    wall = wall_pressure_of(scene, fills)
    driving = scene.gas.pressure + float(wall[0] - wall[1])
    return max(driving, _LEAST * scene.gas.pressure) / scene.liquid.density
