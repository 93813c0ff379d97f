"""Poles of the drives' sampled loops: voltages held over a step, on the masses with their drives.

Friction, the voltage limit and the rotor's whirl are neglected.  The rotor yields, which lowers a mass's
inertia by b^2/M; the drive law compensates this.  A loop is stable when its poles lie within the unit
circle.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ringbalance.controller.eccentric_mass.drive_law import lqr_gain, track_model
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.results.rows import Quantity
from ringbalance.scene.arrays import ComplexArray

GAIN_MARGIN: Final = 2.0
"""Factor by which the recommended gains could be higher before a pole leaves the unit circle."""
_TORQUE_MARGIN: Final = 1.5
"""Ratio of the speed control's torque at standstill to the friction, at the recommended drive speed."""
_SMALL_DECAY: Final = 1e-4
_HALVINGS: Final = 50
_SEARCH_FACTOR: Final = 1e9
"""Largest factor by which the search for a limit departs from the scene's value, up or down."""
_Poles = Callable[[float, float, float], ComplexArray]
"""Function from the key's value, the hold, s, and a factor on the loop's gain to the poles."""


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
        plant, track, keys, lqr = (
            PlantParameters.of(scene),
            track_model(scene),
            scene.friction_filter,
            scene.lqr,
        )

        def regulator_poles(weight: float, hold: float, margin: float) -> ComplexArray:
            position, rate = lqr_gain(track, state_weight=weight, input_weight=lqr.input_weight)
            return _poles(scene, hold, margin * position, margin * rate)

        def pair_poles(pair: float, speed: float, hold: float) -> ComplexArray:
            # Both drives act on the angle between the masses.
            return _poles(scene, hold, 2 * plant.drive_gain * pair, plant.drive_gain * speed, eased=True)

        regulator = _loop(
            scene,
            name="regulator",
            key="lqr.state_weight",
            value=lqr.state_weight,
            unit="",
            poles=regulator_poles,
        )
        speed = _loop(
            scene,
            name="speed control",
            key="friction_filter.speed_gain",
            value=keys.speed_gain,
            unit="V*s/rad",
            poles=lambda gain, hold, margin: _poles(
                scene, hold, 0.0, plant.drive_gain * (margin * gain), eased=True
            ),
        )
        slower = min(speed.value, speed.recommended)
        pair = _loop(
            scene,
            name="pair control",
            key="friction_filter.pair_gain",
            value=keys.pair_gain,
            unit="V/rad",
            poles=lambda gain, hold, margin: pair_poles(margin * gain, keys.speed_gain, hold),
            # With the recommended speed gain, and with a margin on both gains.
            value_poles=lambda gain, hold, margin: pair_poles(margin * gain, slower, hold),
            hold_poles=lambda gain, hold, margin: pair_poles(margin * gain, margin * keys.speed_gain, hold),
            start=keys.pair_gain or slower,
        )
        # Speed w at which B_add gamma w equals the friction torque, times a margin.
        friction = max(plant.friction_arm) * plant.moment * scene.rotor.speed_profile[0].speed ** 2
        drive_speed = max(keys.drive_speed, _TORQUE_MARGIN * friction / (plant.drive_gain * slower))
        step = min(loop.recommended_step for loop in (regulator, speed, pair))
        return cls(regulator=regulator, speed=speed, pair=pair, step=step, drive_speed=drive_speed)


def advised(scene: EccentricScene) -> dict[str, float]:
    """Changes by key, SI: gains lowered to the recommended ones, and a sufficient drive speed."""
    gains = RecommendedGains.of(scene)
    changes = {loop.key: loop.recommended for loop in gains.loops if loop.value > loop.recommended}
    if gains.drive_speed > scene.friction_filter.drive_speed:
        changes["friction_filter.drive_speed"] = gains.drive_speed
    return changes


def _loop(
    scene: EccentricScene,
    *,
    name: str,
    key: str,
    value: float,
    unit: str,
    poles: _Poles,
    value_poles: _Poles | None = None,
    hold_poles: _Poles | None = None,
    start: float | None = None,
) -> _SampledLoop:
    """Judge a loop. Args: `value_poles`: poles that limit the value; `hold_poles`: the hold; default
    `poles`."""
    step, value_poles, hold_poles = scene.lqr.step, value_poles or poles, hold_poles or poles

    def hold_stable(hold: float) -> bool:
        return _inside(hold_poles(value, hold, GAIN_MARGIN))

    return _SampledLoop(
        name=name,
        key=key,
        value=value,
        unit=unit,
        poles=poles(value, step, 1.0),
        gain_margin=_largest(lambda factor: _inside(poles(value, step, factor)), 1.0),
        recommended=_largest(lambda other: _inside(value_poles(other, step, GAIN_MARGIN)), start or value),
        recommended_step=step if hold_stable(step) else _largest(hold_stable, step),
    )


def _poles(
    scene: EccentricScene, step: float, position: float, rate: float, *, eased: bool = False
) -> ComplexArray:
    """Poles, largest first, of the angle between opposite masses, where the rotor yields most.

    Their inertia is J (1 - 2 b^2/(M J)). Args: `eased`: True if the drive law compensates the yielding of the
    rotor; it does not while the imbalance is unknown.
    """
    track, mass = track_model(scene), PlantParameters.of(scene).mass
    given_way = 2 * track.moment**2 / (mass * track.inertia)
    if eased:
        position, rate = (1 - given_way) * position, (1 - given_way) * rate - given_way * track.damping
    decay = track.damping / (track.inertia * (1 - given_way)) * step
    remaining = math.exp(-decay)
    # Mean of the rate, and of its integral, that a step of one unit of torque leaves.
    first = -math.expm1(-decay) / decay if decay > 0 else 1.0
    second = (1 - first) / decay if decay > _SMALL_DECAY else 0.5 - decay / 6
    per_torque = step / (track.inertia * (1 - given_way))
    if position == 0:
        return np.array([remaining - per_torque * first * rate], dtype=np.complex128)
    trace = 1 - per_torque * step * second * position + remaining - per_torque * first * rate
    product = (1 - per_torque * step * second * position) * (remaining - per_torque * first * rate)
    product += per_torque * first * position * step * (first - per_torque * second * rate)
    root = cmath.sqrt(0.25 * trace**2 - product)
    far = 0.5 * trace + (root if trace * root.real >= 0 else -root)
    return np.array([far, product / far if far != 0 else 0.0j], dtype=np.complex128)


def _inside(poles: ComplexArray) -> bool:
    """Return True if all poles lie within the unit circle."""
    return bool(np.max(np.abs(poles)) < 1)


def _largest(stable: Callable[[float], bool], start: float) -> float:
    """Largest stable value, provided that all smaller ones are stable.

    Doubled or halved from `start` until the limit is bracketed, then bisected.  Values far below the limit
    are avoided: there a slow pole rounds to one and would count as unstable.
    """
    low, factor = start, 2.0 if stable(start) else 0.5
    while start / _SEARCH_FACTOR < low < start * _SEARCH_FACTOR and stable(factor * low) == (factor > 1):
        low *= factor
    low, high = (low, 2 * low) if factor > 1 else (0.5 * low, low)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


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
