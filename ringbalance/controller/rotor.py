"""The rotor that several balancers have in common, and frames and signs of the closed loop.

Chamber A lies at angle 0, angles grow with the rotation, letters go counter-clockwise, and the opposite of
chamber i is i + n/2.  Vectors are complex numbers in the frame of the disc; amplitudes are zero-to-peak.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from string import ascii_uppercase
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.algorithms.algorithm import Measurement
from ringbalance.reduced_model.law.flow_law import MomentCurve
from ringbalance.results.rows import Finding
from ringbalance.scene import loop_models
from ringbalance.scene.arrays import ComplexArray
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.loop_models import Runout
from ringbalance.scene.origins import SceneFile

MAX_CHAMBERS: Final = len(ascii_uppercase)
_OF_ONE_ROTOR: Final = ("influence_coefficient", "lag_angle", "initial_vibration")
"""Keys of a rotor whose defaults are those of one machine."""
Sensor = Callable[[float, complex], Measurement | None]
"""Takes the time (s) and the vibration (m, complex) with the scene's runout; None is a dropped sample."""


def chamber_letters(chambers: int) -> tuple[str, ...]:
    """Names of the chambers, counter-clockwise from A at angle 0.

    Raises: ValueError: an odd number, or one outside 2 to 26.
    """
    return tuple(ascii_uppercase[: chamber_directions(chambers).size])


@cache
def chamber_directions(chambers: int) -> ComplexArray:
    """Unit vectors of the chambers' centre lines, e_i = exp(2 pi j i/n); opposite ones are exact negatives.

    Raises: ValueError: an odd number, or one outside 2 to 26.
    """
    if chambers % 2 or not 2 <= chambers <= MAX_CHAMBERS:
        raise ValueError(f"chambers must be even and within 2 to {MAX_CHAMBERS}, not {chambers}")
    half = np.exp(2j * np.pi * np.arange(chambers // 2) / chambers)
    if chambers % 4 == 0:
        half[chambers // 4] = 1j
    directions = np.concatenate([half, -half])
    directions.flags.writeable = False
    return directions


def disc_unbalance(*, moment: MomentCurve, fill_ratio: npt.ArrayLike) -> ComplexArray:
    """Balancing moment of the whole disc, U = sum over pairs of M(x_i, x_(i+n/2)) e_i, kg m.

    M is complex where an imported chamber is asymmetric: its moment along and across the chamber's middle.
    Fill ratios of every chamber in the order of the letters run along the first axis.
    Source: Eqs. 21 and 22 of the liquid-ring paper, for any number of pairs and any moment curve.
    """
    x = np.asarray(fill_ratio, dtype=np.float64)
    half = x.shape[0] // 2
    directions = chamber_directions(x.shape[0])[:half]
    pair = moment.pair_vector(fill_ratio=x[:half], opposite_fill_ratio=x[half:])
    return np.asarray(directions @ pair.reshape(half, -1)).reshape(pair.shape[1:])


def wrapped(angle: float) -> float:
    """Wrap an angle, rad, to (-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))


def noisy_sensor(*, sensor: loop_models.Sensor, seed: int | np.random.Generator) -> Sensor:
    """A sensor with independent Gaussian noise on amplitude and phase from numpy's default generator.

    An amplitude that noise would make negative is folded back, as a rectifying instrument shows it.
    """
    random = np.random.default_rng(seed)

    def measure(time: float, vibration: complex) -> Measurement:
        amplitude_noise, phase_noise = random.standard_normal(2)
        return Measurement(
            time=time,
            amplitude=abs(abs(vibration) + sensor.amplitude_noise * float(amplitude_noise)),
            phase=cmath.phase(vibration) + sensor.phase_noise * float(phase_noise),
        )

    return measure


@dataclass(frozen=True, kw_only=True)
class CommonRotor:
    """Rotor that balancers have in common.

    For a balancer, vibration before balancing and vibration per unbalance describe a rotor at constant speed,
    V = alpha (U_0 + U_balancer).  One rotor therefore means: the same speed, the same complex alpha, the same
    U_0, the same sensor and the same amplitude to come below, within the same time.
    """

    source: str
    """File of the scene that it is taken from."""
    speed: float
    """W, rad/s, above zero."""
    influence: complex
    """alpha, m/(kg m)."""
    unbalance: complex
    """U_0, kg m."""
    mass: float | None
    """M with the balancer, kg; None when the scene does not give it."""
    noise: float
    """Standard deviation of the measured vibration, m."""
    limit: float
    """Amplitude to come below, m."""
    settling_time: float | None = None
    """Time within which to come below it, s; None: that of the run."""
    runout: Runout | None = None
    """Vector that the sensor adds to every vibration; None: nothing."""
    limits_rotor: bool = False
    """True if the limit is one of the rotor itself, where a runout makes the reading another."""

    @property
    def amplitude(self) -> float:
        """Vibration before balancing, m zero-to-peak."""
        return abs(self.influence * self.unbalance)


Rotors = Callable[[int], CommonRotor]
"""The rotor by number of the drawn device that it belongs to."""


_COMPARED_DEVICES: Final = 16
"""Devices that show which of the scenes draws a quantity more widely."""


_ALIKE: Final = 0.01
"""Relative difference of speed, alpha and U_0 up to which two scenes describe one rotor: files state these to
two or three digits, and a balancing run leaves more of a vibration than so small a difference makes."""


def rotor_difference(rotor: CommonRotor, other: CommonRotor) -> str | None:
    """Name of a quantity in which two rotors differ; None: they are one, to the digits of scene files."""
    for name in ("speed", "influence", "unbalance"):
        values = getattr(rotor, name), getattr(other, name)
        if abs(values[0] - values[1]) > _ALIKE * max(map(abs, values)):
            return name
    return None


def joined_rotor(rotor: CommonRotor, other: CommonRotor) -> CommonRotor:
    """Join two descriptions of one rotor: the more vibration, the worse sensor, the narrower limit and
    the shorter time to come below it.

    Symmetric in both: no verdict under it depends on which is named first.
    """
    rougher = max(rotor, other, key=lambda each: (each.amplitude, each.mass or 0.0))
    times = [each.settling_time for each in (rotor, other) if each.settling_time is not None]
    runouts = [each.runout for each in (rotor, other) if each.runout is not None]
    return replace(
        rougher,
        noise=max(rotor.noise, other.noise),
        limit=min(rotor.limit, other.limit),
        settling_time=min(times, default=None),
        # Of equal runouts that whose phase is not known.
        runout=max(runouts, key=lambda each: (each.amplitude, each.phase is None, each.phase), default=None),
        limits_rotor=rotor.limits_rotor or other.limits_rotor,
    )


def rotors_of(nominal: CommonRotor, *scenes: Callable[..., CommonRotor]) -> Rotors:
    """Rotors of drawn devices, each quantity drawn as in the scene that draws it most widely.

    These quantities are speed, magnitude and angle of alpha, and size and direction of the unbalance; the
    order of the scenes does not change their deviations.  Args: `scenes`: `Balancer.rotor` of each.
    """
    deviations = []
    for scene in scenes:
        with suppress(SceneError):
            # A scene whose rotor stands still or does not vibrate is left out.
            if (described := scene()).amplitude > 0.0:
                deviations.append(partial(_deviations, described, scene))
    spread = np.array([np.std([of(n) for n in range(_COMPARED_DEVICES)], axis=0) for of in deviations])
    wider = np.argmax(spread, axis=0)

    def rotor(number: int) -> CommonRotor:
        deviation = np.choose(wider, [of(number) for of in deviations])
        speed, size, angle, unbalance, direction = deviation.tolist()
        return replace(
            nominal,
            speed=nominal.speed * math.exp(speed),
            influence=nominal.influence * cmath.rect(math.exp(size), angle),
            unbalance=nominal.unbalance * cmath.rect(math.exp(unbalance), direction),
        )

    return cache(rotor)


def _deviations(nominal: CommonRotor, rotor_of: Callable[..., CommonRotor], number: int) -> list[float]:
    """Deviations of a device's rotor: logarithms of ratios to the scene's values, and angles."""
    rotor = rotor_of(number)
    influence, unbalance = rotor.influence / nominal.influence, rotor.unbalance / nominal.unbalance
    return [
        math.log(rotor.speed / nominal.speed),
        *(math.log(abs(influence)), cmath.phase(influence)),
        *(math.log(abs(unbalance)), cmath.phase(unbalance)),
    ]


def rotor_fault(scene: SceneFile, path: str, problem: str, allowed: str) -> SceneError:
    """The error about a rotor, or about a balancer that cannot work on it; `path`: of the value to change."""
    table, _, key = path.partition(".")
    return SceneError([Fault(file=scene.file, table=table, key=key, problem=problem, allowed=allowed)])


def vibrating(scene: SceneFile, rotor: CommonRotor) -> CommonRotor:
    """Check that a rotor vibrates, and return it. Raises: SceneError: it does not vibrate."""
    if rotor.amplitude == 0:
        problem = "it does not vibrate: there is nothing to compare"
        raise rotor_fault(scene, "rotor", problem, "an unbalance")
    return rotor


def assumed_rotor(scene: SceneFile) -> Iterator[Finding]:
    """Finding on keys that a scene leaves to defaults that hold for one rotor alone."""
    keys = LIQUID_RING.tables["rotor"].keys
    texts = []
    for key in _OF_ONE_ROTOR:
        if f"rotor.{key}" in scene.defaulted:
            default = keys[key].presence.default
            text = " at ".join(map(str, default.values())) if isinstance(default, Mapping) else str(default)
            texts.append(f"rotor.{key} {text}")
    if texts:
        yield Finding(code="rotor_assumed", values={"values": texts})
