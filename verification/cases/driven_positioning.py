"""The eccentric-mass paper's positioning: effort (Fig. 6), resting positions, and distances of the masses."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.drive_law import DriveLaw, friction_torque, regulator_torque
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import compiled
from ringbalance.verification.evidence import Evidence, FigureCurve, Found, Level, as_found, figure
from ringbalance.verification.papers import changed

_STEP_S: Final = {"light": 4e-4, "heavy": 1e-4}
"""Step of the integration, which is of first order; the effort changes by a thousandth with it."""
_MOVE_S: Final = 3.0
_MASS_RATIOS: Final = (0.035, 0.023)
"""m_b/m_r of Fig. 6."""
_WEIGHT_RATIOS: Final = (1.0, 2.0, 3.5, 5.0)
"""q/r."""
_SPEED_RATIOS: Final = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
"""W over sqrt(K_B/M)."""
_TRAVEL_RAD: Final = (-1.0, 0.6)
_COMPENSATED: Final = {"exact": 1.0, "without": 0.0, "printed": 1.0, "short": 0.8}
"""Fraction of the friction arm that is compensated; as printed the angle stands where the rate belongs."""
_START_RAD: Final = 1.0
"""First distance of a mass from its target."""
_LOST_RAD: Final = 10.0
"""Distance beyond which a mass does not return to its target."""
_NEARLY_COMPENSATED: Final = 0.98
"""Fraction of the friction arm that is compensated where a mass comes to rest."""
_CASES: Final = 20_000
_SEED: Final = 20_200_627
_INSTANTS: Final = 201
_PACE_RATIO: Final = 2.0
"""Rate of approach of the first mass over that of the second, where these differ."""
_ROUND_OFF_RAD: Final = 1e-9


def effort(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Effort of positioning over weights and speed, and its growth by each friction compensation.

    The paper's index is the integral of the regulator's torque alone.  Whirl and compensated friction are
    not in it: the regulator's torque is that of the move itself and of the friction not compensated.
    """
    efforts = _efforts(scene, step=_STEP_S[level])
    grown = {name: growth(each) for name, each in efforts.items()}
    # The first mass ratio at the third weight ratio, which is close to the paper's choice.
    shown = {name: each[0, 2] for name, each in efforts.items()}
    over_speed = figure(
        "effort of one move over the speed",
        ("speed over natural frequency", "1", _SPEED_RATIOS),
        FigureCurve("compensated exactly", "N m s", shown["exact"]),
        FigureCurve("arm assumed a fifth too small", "N m s", shown["short"]),
        FigureCurve("not compensated", "N m s", shown["without"]),
        FigureCurve("as printed", "N m s", shown["printed"], style="paper"),
    )
    exact, short = (float(grown[name if defect is None else "without"].min()) for name in ("exact", "short"))
    return Evidence(
        quantities={"exact": Found(value=exact).moved(0.0, short - exact)},
        numbers={
            "without": grown["without"].min(),
            "without_most": grown["without"].max(),
            "short": grown["short"].min(),
            "as_printed": grown["printed"].min(),
        },
        series=(over_speed,),
    )


def weights(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Growth of the effort with q/r and with the mass ratio."""
    efforts = _efforts(scene, step=_STEP_S[level])
    # Effort at the largest q/r over that at the smallest, and likewise for the mass ratios.
    over_weight = {name: each[:, -1] / each[:, 0] for name, each in efforts.items()}
    over_mass = {name: each[0] / each[1] for name, each in efforts.items()}
    exact, short = ("exact", "short") if defect is None else ("without", "without")
    return Evidence(
        quantities={
            name: Found(value=float(grown[exact].max())).moved(
                0.0, float(grown[short].max() - grown[exact].max())
            )
            for name, grown in (("over_weight", over_weight), ("over_mass", over_mass))
        },
        numbers={
            "weight_without": over_weight["without"].max(),
            "mass_without": over_mass["without"].min(),
            "mass_without_most": over_mass["without"].max(),
        },
    )


def _efforts(scene: EccentricScene, *, step: float) -> Mapping[str, FloatArray]:
    """Effort J(q, r) of one move, N m s, by the kind of friction compensation: the paper's Fig. 6.

    Returns: Arrays of shape (mass ratios, weight ratios, speed ratios).
    """
    shape = (len(_MASS_RATIOS), len(_WEIGHT_RATIOS), len(_SPEED_RATIOS))
    arm, efforts = scene.masses.friction_arm[0], {name: np.empty(shape) for name in _COMPENSATED}
    for i, j in np.ndindex(shape[:2]):
        heavier = changed(scene, {"masses.mass": _MASS_RATIOS[i] * scene.rotor.mass})
        weighted = changed(heavier, {"lqr.state_weight": _WEIGHT_RATIOS[j] * scene.lqr.input_weight})
        law = DriveLaw.of(weighted)._replace(breaks_away=True, slow=0.0, near=0.0)
        natural = math.sqrt(scene.rotor.stiffness / (scene.rotor.mass * (1 + 2 * _MASS_RATIOS[i])))
        for (name, share), (k, ratio) in itertools.product(_COMPENSATED.items(), enumerate(_SPEED_RATIOS)):
            speed, printed = ratio * natural, name == "printed"
            result = _move(law, arm, share * arm, speed, *_TRAVEL_RAD, step, _MOVE_S, printed)
            efforts[name][i, j, k] = result[0]
    return efforts


def growth(effort: FloatArray) -> FloatArray:
    """Effort at the highest over that at the lowest speed, shape (mass ratios, weight ratios)."""
    return np.asarray(effort[..., -1] / effort[..., 0], dtype=np.float64)


@compiled
def _move(
    law: DriveLaw,
    arm: float,
    assumed_arm: float,
    speed: float,
    first: float,
    second: float,
    step: float,
    duration: float,
    printed: bool,
) -> tuple[float, float]:
    """Move two masses to their targets from distances in rad, the whirl's loads compensated.

    Returns: Integral of the norm of the regulator's torques, N m s; final distance of the first mass from its
        target, rad, or the distance at which the run stops because the mass is lost.
    Source: Eqs. 40 and 55 of the paper on eccentric masses.
    """
    angle, rate, torque = np.array([-first, -second]), np.zeros(2), np.zeros(2)
    total = 0.0
    for _ in range(round(duration / step)):
        for i in range(2):
            torque[i] = regulator_torque(law, angle[i], rate[i], 0.0)
            if printed:
                extra = _printed_compensation(law, assumed_arm, speed, angle[i], rate[i])
            else:
                extra = friction_torque(law, assumed_arm, 0.0, speed, rate[i], -angle[i])
            net = torque[i] + extra - law.track.damping * rate[i]
            rate[i] = _later_rate(law, arm, speed, rate[i], net, step)
            angle[i] += step * rate[i]
        total += step * math.hypot(torque[0], torque[1])
        if abs(angle[0]) > _LOST_RAD:
            break
    return total, abs(angle[0])


@compiled
def _printed_compensation(law: DriveLaw, arm: float, speed: float, angle: float, rate: float) -> float:
    """Friction torque by the paper, N m: with the angle in place of the rate, and none for a resting mass.

    Source: part (b) of Eq. 39 of the paper on eccentric masses.
    """
    sense = 0.0 if rate == 0 else math.copysign(1.0, rate)
    return sense * max(arm, 0.0) * law.track.moment * (speed + angle) ** 2


@compiled
def _later_rate(law: DriveLaw, arm: float, speed: float, rate: float, net: float, step: float) -> float:
    """Rate one step later under dry friction; a mass that would reverse within the step rests first."""
    most = arm * law.track.moment * (speed + rate) ** 2
    if rate == 0:
        if abs(net) <= most:
            return 0.0
        return step * (net - math.copysign(most, net)) / law.track.inertia
    later = rate + step * (net - math.copysign(most, rate)) / law.track.inertia
    return 0.0 if later * rate < 0 else later


def stability(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Resting distance of a mass from its target under friction, and the slowest pole of the linear loop."""
    law = DriveLaw.of(scene)._replace(breaks_away=True, slow=0.0, near=0.0)
    if defect == "gain_turned":
        law = law._replace(position_gain=-law.position_gain)
    arm = 0.0 if defect == "no_friction" else scene.masses.friction_arm[0]
    speed = scene.rotor.speed_profile[0].speed
    # Slowest pole of (J + J_add) e'' + (C_add + k_d) e' + k_p e = 0, 1/s.
    polynomial = [law.track.inertia, law.track.damping + law.rate_gain, law.position_gain]
    decay = -float(np.max(np.roots(polynomial).real))
    duration = 25.0 / abs(decay)
    rest, exact = (
        _move(law, arm, share * arm, speed, _START_RAD, 0.0, _STEP_S[level], duration, False)[1]
        for share in (_NEARLY_COMPENSATED, 1.0)
    )
    friction = law.track.moment * speed**2
    return Evidence(
        quantities={"rest": Found(value=rest, corrected=exact), "decay": Found(value=decay)},
        numbers={
            "band": (1 - _NEARLY_COMPENSATED) * arm * friction / abs(law.position_gain),
            "exact": exact,
            "step": scene.lqr.step,
            "margin": RecommendedGains.of(scene).regulator.gain_margin,
        },
    )


def collision(scene: EccentricScene, level: Level, defect: str | None = None) -> Evidence:
    """Random masses on their ways to targets assigned by the paper's rule.

    The fraction of cases in which they come nearer on the way than at both of its ends is judged.
    Source: Eqs. 26 to 28 of the paper on eccentric masses.
    """
    random = np.random.default_rng(_SEED)
    start = random.uniform(-np.pi, np.pi, (2, _CASES))
    phase = random.uniform(-np.pi, np.pi, _CASES)
    # Targets are phi_im +- beta, with beta on the far side of the imbalance.
    half_angle = random.uniform(np.pi / 2, np.pi, _CASES)
    goal = np.stack([phase + half_angle, phase - half_angle])
    # The rule: the least sum of squared travels.
    straight = np.sum((start - goal) ** 2, axis=0)
    crossed = np.sum((start - goal[::-1]) ** 2, axis=0)
    printed = np.where(straight <= crossed, goal, goal[::-1])
    fractions = {
        "printed": _nearer(start, printed, pace_ratio=1.0),
        "other_assignment": _nearer(start, printed[::-1], pace_ratio=1.0),
        "unequal_pace": _nearer(start, printed, pace_ratio=_PACE_RATIO),
    }
    return Evidence(
        quantities=as_found(nearer=fractions[defect or "printed"]),
        numbers={
            "cases": _CASES,
            "other": fractions["other_assignment"],
            "unequal": fractions["unequal_pace"],
        },
    )


def _nearer(start: FloatArray, goal: FloatArray, *, pace_ratio: float) -> float:
    """Fraction of the cases in which the distance along the track falls below that at both ends.

    Both masses approach their targets exponentially; the first one `pace_ratio` times as fast.
    """
    left = np.exp(-np.linspace(0.0, 30.0, _INSTANTS))
    left[0], left[-1] = 1.0, 0.0
    least = np.full(_CASES, np.inf)
    for fraction in left:
        difference = (goal[1] + (start[1] - goal[1]) * fraction) - (
            goal[0] + (start[0] - goal[0]) * fraction**pace_ratio
        )
        least = np.minimum(least, _distance(difference))
    ends = np.minimum(_distance(start[1] - start[0]), _distance(goal[1] - goal[0]))
    return float(np.mean(least < ends - _ROUND_OFF_RAD))


def _distance(difference: FloatArray) -> FloatArray:
    """Distance between two masses along the shorter arc, rad."""
    return np.asarray(np.abs(np.pi - (np.pi - difference) % (2 * np.pi)), dtype=np.float64)
