"""Appendix B: the printed force beside the largest one, and the corrected bound beside a run.

The printed argument shows that the energy falls while the rotor's fixed-frame velocity exceeds Y/C_B, and
concludes that the motion is bounded.  That does not follow: nothing is said of the displacement, and the
energy may rise while the velocity is small.  Integrating the impulse response does give a bound.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.verification.cases.driven_fig7_positioning.case import BalancingFigure
from ringbalance.verification.evidence import Evidence, Found, Level

_RATE = 1.0
"""rad/s, of the masses against the rotor."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Forces and amplitudes against their bounds."""
    speed = scene.rotor.speed_profile[0].speed
    parameters = PlantParameters.of(scene)
    turning = motion_bound(parameters, speed=speed, rate=_RATE)
    judged = motion_bound(parameters, speed=0.0, rate=_RATE) if defect == "rotor_at_rest" else turning
    bound = turning.amplitude
    if defect == "response_left_out":
        bound = parameters.unbalance * speed**2 / parameters.stiffness
    missing = 2 * parameters.moment * speed**2
    largest = max(run.worst_amplitude for run in BalancingFigure.seven(scene).runs)
    return Evidence(
        found={
            "force_ratio": Found(
                value=judged.printed_force / judged.force,
                corrected=(judged.printed_force + missing) / judged.force,
            ),
            "amplitude_ratio": Found(value=largest / bound),
        },
        numbers={"bound": turning.amplitude, "largest": largest},
    )


class _MotionBound(NamedTuple):
    """Bounds on the rotor's motion in the fixed frame, for masses that move within given rates."""

    force: float
    """Y, largest force on the rotor, N."""
    printed_force: float
    """Y from the printed F_T, which drops b W^2 of each mass, N."""
    amplitude: float
    """Bound on |Z| once the start's transient is gone, m."""


def motion_bound(parameters: PlantParameters, *, speed: float, rate: float) -> _MotionBound:
    """Bound the rotor's motion for masses that move with at most a given rate.

    M Z'' + C_B Z' + K_B Z = F with |F| <= Y = U W^2 + 2 b (W + w)^2, so |Z| <= Y int |h| dt, where
    the impulse response h of an underdamped rotor has int |h| dt = coth(pi zeta/(2 sqrt(1 - zeta^2)))/K_B.
    Raises: ValueError: no damping, which bounds nothing, or so much that the rotor does not swing.
    Source: Appendix B of the paper on eccentric masses, corrected.
    """
    ratio = parameters.damping / (2 * math.sqrt(parameters.stiffness * parameters.mass))
    if not 0 < ratio < 1:
        raise ValueError("the damping ratio of the rotor must lie between 0 and 1, both excluded")
    root = math.sqrt(1 - ratio**2)
    b, w = parameters.moment, abs(speed)
    force = parameters.unbalance * w**2 + 2 * b * (w + rate) ** 2
    printed = parameters.unbalance * w**2 + 2 * b * (rate**2 + 2 * w * rate)
    amplitude = force / parameters.stiffness / math.tanh(math.pi * ratio / (2 * root))
    return _MotionBound(force, printed, amplitude)
