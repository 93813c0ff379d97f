"""Where a mass comes to rest under the regulator with friction, and the poles of the linear loop."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import DriveLaw
from ringbalance.controller.eccentric_mass.step import friction_torque, regulator_torque
from ringbalance.verification.cases.driven_fig6_effort.case import later_rate
from ringbalance.verification.evidence import Evidence, Found, Level

_STEP: Final = {"light": 4e-4, "heavy": 1e-4}
"""s, of the integration."""
_START: Final = -1.0
"""rad, from the target."""
_KNOWN: Final = 0.98
"""Of the friction arm, what is compensated."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Distance from the target at rest, and the decay of the slowest pole."""
    law = DriveLaw.of(scene)._replace(breaks_away=True, slow=0.0, near=0.0)
    if defect == "gain_turned":
        law = law._replace(position_gain=-law.position_gain)
    arm = 0.0 if defect == "no_friction" else scene.masses.friction_arm[0]
    speed = scene.rotor.speed_profile[0].speed
    decay = _decay(law)
    duration = 25.0 / abs(decay)
    rest, exact = (_rest(law, arm, share * arm, speed, _STEP[level], duration) for share in (_KNOWN, 1.0))
    friction = law.track.moment * speed**2
    return Evidence(
        found={"rest": Found(value=rest, corrected=exact), "decay": Found(value=decay)},
        numbers={
            "band": (1 - _KNOWN) * arm * friction / abs(law.position_gain),
            "exact": exact,
            "step": scene.lqr.step,
            "margin": RecommendedGains.of(scene).regulator.gain_margin,
        },
    )


def _decay(law: DriveLaw) -> float:
    """Of the slowest pole of (J + J_add) e'' + (C_add + k_d) e' + k_p e = 0, 1/s."""
    polynomial = [law.track.inertia, law.track.damping + law.rate_gain, law.position_gain]
    return -float(np.max(np.roots(polynomial).real))


def _rest(law: DriveLaw, arm: float, compensated: float, speed: float, step: float, duration: float) -> float:
    """Distance from its target of a mass after a move, rad."""
    angle, rate = _START, 0.0
    for _ in range(round(duration / step)):
        torque = regulator_torque(law, angle, rate, 0.0)
        torque += friction_torque(law, compensated, 0.0, speed, rate, -angle)
        rate = later_rate(law, arm, speed, rate, torque - law.track.damping * rate, step)
        angle += step * rate
        if abs(angle) > abs(10 * _START):
            break
    return abs(angle)
