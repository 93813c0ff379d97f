"""Poles and gain margins of the drives' sampled loops: voltages held over a step, on the masses with drives.

Friction, the voltage limit and the rotor's whirl are neglected.  The rotor yields, which lowers the inertia
of the angle between opposite masses, where it yields most, to J (1 - 2 b^2/(M J)); the drive law compensates
this once the imbalance is known.  A loop is stable when its poles lie within the unit circle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.optimize import brentq

from ringbalance.controller.eccentric_mass.drive_law import lqr_gain, track_model
from ringbalance.controller.eccentric_mass.plant import Pair, PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.results.rows import Quantity
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.origins import value_at

GAIN_MARGIN: Final = 2.0
"""Factor by which the recommended gains could be higher before a pole leaves the unit circle."""
_TORQUE_MARGIN: Final = 1.5
"""Ratio of the speed control's torque at standstill to the friction, at the recommended drive speed."""
_SEARCH_FACTOR: Final = 1e9
"""Largest factor by which a limit departs from the scene's value, up or down."""
_SMALL_DECAY, _ROUNDING = 1e-4, 1e-12


@dataclass(frozen=True, kw_only=True)
class _SampledLoop:
    """Sampled control loop of the drives."""

    name: str
    key: str
    """Key of the scene that sets its gain."""
    value: float
    """Value of that key, in SI."""
    unit: str
    """Unit of that key; empty for the weight q, which has none."""
    poles: ComplexArray
    """Poles per step, shape (1,) or (2,)."""
    gain_margin: float
    """Factor by which the loop's own gain could grow before a pole leaves the unit circle."""
    recommended: float
    """Largest value of the key that leaves a gain margin of two."""
    recommended_step: float
    """Longest hold of the voltage that leaves this margin with the scene's gains, s; at most the scene's."""

    @property
    def radius(self) -> float:
        """Largest magnitude of the poles."""
        return float(np.max(np.abs(self.poles)))

    @property
    def stable(self) -> bool:
        """True if all poles lie within the unit circle."""
        return self.radius < 1


@dataclass(frozen=True, kw_only=True)
class RecommendedGains:
    """Sampled poles of a scene's loops, and values of its keys that make them stable and strong enough."""

    regulator: _SampledLoop
    """Loop of all stages but the friction stage: `lqr.state_weight`."""
    speed: _SampledLoop
    """Loop of the friction stage: `friction_filter.speed_gain`."""
    pair: _SampledLoop
    """Loop of the angle between the masses in the friction stage: `friction_filter.pair_gain`."""
    step: float
    """Longest hold of the voltage that leaves every loop a gain margin of two with the scene's gains, s."""
    drive_speed: float
    """Drive speed that overcomes friction with a margin, at the lower of the scene's and the recommended
    speed gain, rad/s; at least the scene's."""

    @property
    def loops(self) -> tuple[_SampledLoop, _SampledLoop, _SampledLoop]:
        """Regulator, speed and pair."""
        return self.regulator, self.speed, self.pair

    @classmethod
    def of(cls, scene: EccentricScene) -> RecommendedGains:
        """Judge the loops of a scene before it is run."""
        plant, keys, lqr = PlantParameters.of(scene), scene.friction_filter, scene.lqr
        volt, track = plant.drive_gain, track_model(scene)
        regulator = _judged(
            scene,
            *("regulator", "lqr.state_weight", ""),
            gain=lambda weight: lqr_gain(track, state_weight=weight, input_weight=lqr.input_weight),
            eased=False,
        )
        speed = _judged(
            scene,
            *("speed control", "friction_filter.speed_gain", "V*s/rad"),
            gain=lambda speed_gain: (0.0, volt * speed_gain),
        )
        slower = min(speed.value, speed.recommended)
        pair = _judged(
            scene,
            *("pair control", "friction_filter.pair_gain", "V/rad"),
            # Both drives act on the angle between the masses.
            gain=lambda pair_gain: (2 * volt * pair_gain, 0.0),
            other_rate=volt * keys.speed_gain,
            recommended_rate=volt * slower,
            start=keys.pair_gain or slower,
        )
        # Speed w at which B_add gamma w equals the friction torque, times a margin.
        friction = max(plant.friction_arm) * plant.moment * scene.rotor.speed_profile[0].speed ** 2
        drive_speed = max(keys.drive_speed, _TORQUE_MARGIN * friction / (volt * slower))
        step = min(loop.recommended_step for loop in (regulator, speed, pair))
        return cls(regulator=regulator, speed=speed, pair=pair, step=step, drive_speed=drive_speed)


def advised(scene: EccentricScene) -> dict[str, float]:
    """Changes by key, SI: gains lowered to the recommended ones, and a sufficient drive speed."""
    gains = RecommendedGains.of(scene)
    changes = {loop.key: loop.recommended for loop in gains.loops if loop.value > loop.recommended}
    if gains.drive_speed > scene.friction_filter.drive_speed:
        changes["friction_filter.drive_speed"] = gains.drive_speed
    return changes


def _judged(
    scene: EccentricScene,
    name: str,
    key: str,
    unit: str,
    *,
    gain: Callable[[float], Pair],
    eased: bool = True,
    other_rate: float = 0.0,
    recommended_rate: float = 0.0,
    start: float | None = None,
) -> _SampledLoop:
    """Judge a loop.

    Args: `gain`: gains of angle, N m/rad, and rate, N m s/rad, by the value of the key. `eased`: True if the
    drive law compensates the yielding of the rotor. `other_rate`: gain of the rate of another control in the
    loop as judged; `recommended_rate`: in that of a recommended value. `start`: value from which this is
    searched; default the scene's.
    """
    value, step, track = value_at(scene, key), scene.lqr.step, track_model(scene)
    yielding = 2 * track.moment**2 / (PlantParameters.of(scene).mass * track.inertia)
    inertia, ratio = track.inertia * (1 - yielding), 1 - yielding if eased else 1.0
    compensated = yielding * track.damping if eased else 0.0

    def closed(hold: float, gains: Pair, *, order: int) -> FloatArray:
        """Matrix of angle and rate, or of the rate alone, from one hold of the voltage to the next."""
        decay = track.damping / inertia * hold
        # Mean of the rate, and of its integral, that a hold of one unit of torque leaves.
        first = -math.expm1(-decay) / decay if decay > 0 else 1.0
        second = (1 - first) / decay if decay > _SMALL_DECAY else 0.5 - decay / 6
        held = np.array([[1.0, hold * first], [0.0, math.exp(-decay)]])
        entry, feedback = (hold * second, first), (ratio * gains[0], ratio * gains[1] - compensated)
        return np.asarray((held - hold / inertia * np.outer(entry, feedback))[2 - order :, 2 - order :])

    def margin(hold: float, gains: Pair, fixed: float) -> float:
        order = 2 if gains[0] else 1
        without = closed(hold, (0.0, fixed), order=order)
        return _margin(without, closed(hold, (gains[0], gains[1] + fixed), order=order))

    angle, rate = gain(value)
    poles = np.linalg.eigvals(closed(step, (angle, rate + other_rate), order=2 if angle else 1))

    def hold_margin(hold: float) -> float:
        return margin(hold, (angle, rate + other_rate), 0.0)

    return _SampledLoop(
        name=name,
        key=key,
        value=value,
        unit=unit,
        poles=poles[np.argsort(-np.abs(poles))].astype(np.complex128),
        gain_margin=min(margin(step, (angle, rate), other_rate), _SEARCH_FACTOR),
        recommended=_largest(lambda other: margin(step, gain(other), recommended_rate), start or value),
        recommended_step=step if hold_margin(step) >= GAIN_MARGIN else _largest(hold_margin, step),
    )


def _margin(without: FloatArray, closed: FloatArray) -> float:
    """Largest factor on a gain with all poles in the unit circle, from the loop without it and with it.

    Jury's conditions det(1 + A) > 0 and det A < 1 are linear in the factor; p(1) > 0 holds for any gain.
    """
    unit = np.eye(len(closed))
    before, after = (
        (float(np.linalg.det(unit + loop)), 1.0 - float(np.linalg.det(loop))) for loop in (without, closed)
    )
    if min(before) < -_ROUNDING:
        return 0.0
    falling = (pair for pair in zip(before, after, strict=True) if pair[1] < pair[0] - _ROUNDING)
    return min((max(a, 0.0) / (a - b) for a, b in falling), default=math.inf)


def _largest(margin: Callable[[float], float], start: float) -> float:
    """Largest value with the required margin, which falls with the value."""

    def excess(decades: float) -> float:
        return math.log(min(max(margin(start * 10**decades), 1e-12), 1e12) / GAIN_MARGIN)

    far = math.log10(_SEARCH_FACTOR)
    if excess(far) >= 0 or excess(-far) <= 0:
        return start * (_SEARCH_FACTOR if excess(far) >= 0 else 1 / _SEARCH_FACTOR)
    return float(start * 10 ** brentq(excess, -far, far, xtol=1e-13))


def loops_status(gains: RecommendedGains) -> str:
    """Sentence on the gain margins of the loops and the change that restores them."""
    unstable = ", ".join(loop.name for loop in gains.loops if not loop.stable)
    high = [loop for loop in gains.loops if loop.value > loop.recommended]
    if not unstable and not high:
        return "every loop of the drives is stable with a gain margin of two"
    problem = f"unstable: {unstable}" if unstable else "a gain margin is below two"
    changes = ", ".join(f"{loop.key} to {loop.recommended:.4g} {loop.unit}".rstrip() for loop in high)
    cure = f"lower {changes}, or hold" if changes else "hold"
    return f"{problem}: {cure} the voltage for at most {gains.step:.4g} s"


def loops_document(gains: RecommendedGains) -> dict[str, Any]:
    """Turn the loops into plain numbers for JSON, SI."""
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
    """Largest key values that leave a gain margin of two."""
    largest = (
        Quantity(key=loop.key, name=f"{loop.key}, at most", value=loop.recommended, unit=loop.unit or "1")
        for loop in gains.loops
    )
    return (*largest, Quantity(key="voltage_hold", name="voltage hold, at most", unit="s", value=gains.step))
