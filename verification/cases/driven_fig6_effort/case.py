"""What positioning costs over weights and speed, and which friction compensation makes it grow.

The paper's index is the integral of the regulator's torque alone.  Whirl and compensated friction are not in
it: what the regulator has to do is the move itself and the friction that compensation leaves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.settings import DriveLaw
from ringbalance.controller.eccentric_mass.step import friction_torque, regulator_torque
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import compiled
from ringbalance.verification.eccentric_scenes import changed
from ringbalance.verification.evidence import Curve, Evidence, Level, Series, as_found, figure

STEP = {"light": 4e-4, "heavy": 1e-4}
"""s, of the integration, which is of first order; the effort hangs on it by a thousandth."""
_DURATION = 3.0
"""Of the move, s."""
_MASS_RATIOS = (0.035, 0.023)
"""m_b/m_r of Fig. 6."""
_WEIGHT_RATIOS = (1.0, 2.0, 3.5, 5.0)
"""q/r."""
_SPEED_RATIOS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
"""W over sqrt(K_B/M)."""
_TRAVEL = (-1.0, 0.6)
"""rad, of the two masses."""
_SHARES = {"exact": 1.0, "without": 0.0, "printed": 1.0, "short": 0.8}
"""Of the friction arm that is compensated; as printed the angle stands where the rate belongs."""


def compute(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Growth of the effort with the speed."""
    found = efforts(scene, step=STEP[level])
    grown = {name: growth(effort) for name, effort in found.items()}
    return Evidence(
        found=as_found(exact=grown["exact" if defect is None else "without"].min()),
        numbers={
            "without": grown["without"].min(),
            "without_most": grown["without"].max(),
            "short": grown["short"].min(),
            "as_printed": grown["printed"].min(),
        },
        series=(_figure(found),),
    )


def efforts(scene: EccentricScene, *, step: float) -> Mapping[str, FloatArray]:
    """Effort J(q, r) of one move, N m s, by the way in which friction is compensated: the paper's Fig. 6.

    Returns: Of shape (mass ratios, weight ratios, speed ratios).
    """
    return {
        name: np.array(
            [
                [
                    _over_speed(scene, mass, weight, name == "printed", share, step)
                    for weight in _WEIGHT_RATIOS
                ]
                for mass in _MASS_RATIOS
            ]
        )
        for name, share in _SHARES.items()
    }


def growth(effort: FloatArray) -> FloatArray:
    """Effort at the highest over that at the lowest speed, shape (mass ratios, weight ratios)."""
    return np.asarray(effort[..., -1] / effort[..., 0], dtype=np.float64)


@compiled
def _positioning_effort(
    law: DriveLaw,
    arm: float,
    believed_arm: float,
    speed: float,
    first: float,
    second: float,
    step: float,
    duration: float,
    printed: bool,
) -> float:
    """Integral of the norm of the regulator's torques over a move, N m s, the whirl's loads compensated.

    Source: Eqs. 40 and 55 of the paper on eccentric masses.
    """
    angle, rate, asked = np.array([-first, -second]), np.zeros(2), np.zeros(2)
    total = 0.0
    for _ in range(round(duration / step)):
        for i in range(2):
            asked[i] = regulator_torque(law, angle[i], rate[i], 0.0)
            if printed:
                extra = printed_compensation(law, believed_arm, speed, angle[i], rate[i])
            else:
                extra = friction_torque(law, believed_arm, 0.0, speed, rate[i], -angle[i])
            net = asked[i] + extra - law.track.damping * rate[i]
            rate[i] = later_rate(law, arm, speed, rate[i], net, step)
            angle[i] += step * rate[i]
        total += step * math.hypot(asked[0], asked[1])
    return total


@compiled
def printed_compensation(law: DriveLaw, arm: float, speed: float, angle: float, rate: float) -> float:
    """Friction's torque by the paper, N m: the angle stands for the rate, and a resting mass gets none.

    Source: part (b) of Eq. 39 of the paper on eccentric masses.
    """
    sense = 0.0 if rate == 0 else math.copysign(1.0, rate)
    return sense * max(arm, 0.0) * law.track.moment * (speed + angle) ** 2


@compiled
def later_rate(law: DriveLaw, arm: float, speed: float, rate: float, net: float, step: float) -> float:
    """Rate one step later under dry friction; a mass that would turn round within the step rests first."""
    most = arm * law.track.moment * (speed + rate) ** 2
    if rate == 0:
        if abs(net) <= most:
            return 0.0
        return step * (net - math.copysign(most, net)) / law.track.inertia
    later = rate + step * (net - math.copysign(most, rate)) / law.track.inertia
    return 0.0 if later * rate < 0 else later


def _over_speed(
    scene: EccentricScene, mass_ratio: float, weight_ratio: float, printed: bool, share: float, step: float
) -> list[float]:
    heavier = changed(scene, "masses", mass=mass_ratio * scene.rotor.mass)
    weighted = changed(heavier, "lqr", state_weight=weight_ratio * scene.lqr.input_weight)
    law = DriveLaw.of(weighted)._replace(breaks_away=True, slow=0.0, near=0.0)
    natural = math.sqrt(scene.rotor.stiffness / (scene.rotor.mass * (1 + 2 * mass_ratio)))
    arm = scene.masses.friction_arm[0]
    return [
        _positioning_effort(law, arm, share * arm, ratio * natural, *_TRAVEL, step, _DURATION, printed)
        for ratio in _SPEED_RATIOS
    ]


def _figure(found: Mapping[str, FloatArray]) -> Series:
    """The first mass ratio at the third weight, near the paper's own choice."""
    at = (0, 2)
    return figure(
        "effort of one move over the speed",
        ("speed over natural frequency", "1", _SPEED_RATIOS),
        Curve("compensated exactly", "N m s", found["exact"][at]),
        Curve("arm assumed a fifth too small", "N m s", found["short"][at]),
        Curve("not compensated", "N m s", found["without"][at]),
        Curve("as printed", "N m s", found["printed"][at], style="paper"),
    )
