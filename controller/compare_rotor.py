"""One rotor for two balancers: taken from one scene, put into the other.

What a balancer knows of a rotor at constant speed is its vibration before balancing and its vibration per
unbalance, V = alpha (U_0 + U_balancer).  One rotor therefore means: the same speed, the same complex alpha,
the same U_0, the same sensor and the same amplitude to come below.  A liquid-ring scene gives alpha outright.
A scene with eccentric masses gives it by mass, stiffness and damping,

    alpha = W^2 / (K_B - M W^2 + j C_B W),

and takes it back as K_B = M W^2 + Re(W^2 / alpha) and C_B = Im(W^2 / alpha) / W, with the mass M of rotor and
balancer together, which alpha at one speed leaves open.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace

from ringbalance.controller.eccentric_mass.plant.parameters import PlantParameters, speed_at
from ringbalance.controller.rotor import wrapped
from ringbalance.reduced_model.chamber.gravity import check_ring
from ringbalance.scene.eccentric_models import EccentricRotor, EccentricScene, SpeedPoint
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene

_FINEST_SHARE = 0.01
"""Noise that a filter assumes, at the least, as a share of the amplitude to come below."""
_SETTLED_WHIRL = 12.0
"""Time constants of the free whirl after which a run with eccentric masses starts to balance."""


@dataclass(frozen=True, kw_only=True)
class OneRotor:
    """What two balancers have in common."""

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

    @property
    def amplitude(self) -> float:
        """Vibration before balancing, m zero-to-peak."""
        return abs(self.influence * self.unbalance)

    def scene(self, scene: AnyScene) -> AnyScene:
        """Put a scene's balancer on another scene's rotor, at constant speed and in its own steady vibration.

        Raises: SceneError: the rotor cannot be this scene's.
        """
        return _liquid_on(self, scene) if isinstance(scene, Scene) else _driven_on(self, scene)

    @classmethod
    def of(cls, scene: AnyScene) -> OneRotor:
        """Take the rotor out of a scene; of eccentric masses the speed counts at which their strategy starts.

        Raises: SceneError: the rotor stands still, turns backwards, or does not vibrate at all.
        """
        found = _liquid_rotor(scene) if isinstance(scene, Scene) else _driven_rotor(scene)
        if found.amplitude == 0:
            raise _refusal(
                scene, "rotor", "", "it does not vibrate: there is nothing to compare", "an unbalance"
            )
        return found


def _liquid_rotor(scene: Scene) -> OneRotor:
    rotor = scene.rotor
    return OneRotor(
        source=scene.source,
        speed=rotor.speed,
        influence=rotor.influence,
        unbalance=rotor.initial_unbalance,
        mass=None,
        noise=scene.sensor.amplitude_noise,
        limit=scene.controller.limit,
    )


def _driven_rotor(scene: EccentricScene) -> OneRotor:
    speed, _ = speed_at(*scene.rotor.profile, scene.supervisor.start)
    if speed <= 0:
        problem = "the rotor does not turn forwards when balancing starts"
        raise _refusal(scene, "rotor", "speed_profile", problem, "a speed above 0 rpm at that time")
    parameters = PlantParameters.of(scene)
    if parameters.damping == 0:
        problem = "without damping the vibration before balancing never becomes steady"
        raise _refusal(scene, "rotor", "damping", problem, "a damping coefficient above 0 N*s/m")
    imbalance = scene.imbalance
    return OneRotor(
        source=scene.source,
        speed=speed,
        influence=parameters.influence(speed),
        unbalance=cmath.rect(imbalance.mass * imbalance.radius, imbalance.phase),
        mass=parameters.mass,
        noise=scene.sensor.position_noise,
        limit=scene.supervisor.limit,
    )


def own_scene(scene: AnyScene) -> AnyScene:
    """Make a scene ready to balance its own rotor in a comparison.

    A liquid ring's scene stays as it is; eccentric masses run as on any other rotor: at the constant speed at
    which their strategy starts, opposite each other, in the rotor's steady vibration before they start, and
    with the noise that both balancers have.
    """
    return scene if isinstance(scene, Scene) else _driven_on(_driven_rotor(scene), scene)


def _liquid_on(rotor: OneRotor, scene: Scene) -> Scene:
    """Valve-open times are rescaled to the same valve-open time per unbalance; a wrong assumption stays as
    wrong as it was."""
    own, control = scene.rotor, scene.controller
    coefficient, lag = abs(rotor.influence), -cmath.phase(rotor.influence)
    share = coefficient / own.influence_coefficient
    vibration = rotor.influence * rotor.unbalance
    phase_noise = min(rotor.noise / abs(vibration), 1.0)
    told = replace(
        scene,
        rotor=replace(
            own,
            speed=rotor.speed,
            influence_coefficient=coefficient,
            lag_angle=lag,
            initial_amplitude=abs(vibration),
            initial_phase=cmath.phase(vibration),
        ),
        sensor=replace(scene.sensor, amplitude_noise=rotor.noise, phase_noise=phase_noise),
        controller=replace(
            control,
            limit=rotor.limit,
            proportional=control.proportional / share,
            fine_below=control.fine_below * share,
            assumed_influence_coefficient=control.assumed_influence_coefficient * share,
            assumed_lag_angle=wrapped(control.assumed_lag_angle - own.lag_angle + lag),
        ),
    )
    check_ring(told)
    return told


def _driven_on(rotor: OneRotor, scene: EccentricScene) -> EccentricScene:
    """The rotor's mass, stiffness and damping follow from alpha; a wrong assumption stays as wrong as it
    was."""
    before, masses = scene.rotor, scene.masses
    whole = before.mass + 2 * masses.mass if rotor.mass is None else rotor.mass
    dynamic = rotor.speed**2 / rotor.influence
    found = replace(
        before,
        mass=whole - 2 * masses.mass,
        stiffness=whole * rotor.speed**2 + dynamic.real,
        damping=dynamic.imag / rotor.speed,
    )
    _check_rotor(rotor, scene, found)
    radius = scene.imbalance.radius
    imbalance = replace(
        scene.imbalance, mass=abs(rotor.unbalance) / radius, phase=cmath.phase(rotor.unbalance)
    )
    velocity_noise = rotor.noise * rotor.speed
    believed = scene.imbalance_filter
    assumed = max(rotor.noise, _FINEST_SHARE * rotor.limit)
    louder = assumed / believed.position_noise
    stiffer = found.stiffness / before.stiffness
    heavier = whole / (before.mass + 2 * masses.mass)
    filtered = replace(
        believed,
        position_noise=assumed,
        velocity_noise=assumed * rotor.speed,
        velocity_walk=believed.velocity_walk * louder * stiffer / heavier,
        unbalance_walk=believed.unbalance_walk * louder * heavier,
        assumed_mass=believed.assumed_mass * (found.mass / before.mass),
        assumed_stiffness=believed.assumed_stiffness * stiffer,
        assumed_damping=_rescaled(believed.assumed_damping, before.damping, found.damping),
    )
    told = replace(
        scene,
        rotor=found,
        imbalance=imbalance,
        sensor=replace(scene.sensor, position_noise=rotor.noise, velocity_noise=velocity_noise),
        imbalance_filter=filtered,
        supervisor=replace(scene.supervisor, limit=rotor.limit),
    )
    return _steady_start(told, rotor.speed)


def _rescaled(believed: float, true: float, now: float) -> float:
    return now if true == 0 else believed * (now / true)


def _steady_start(scene: EccentricScene, speed: float) -> EccentricScene:
    """At constant speed; the strategy waits until the vibration from the rotor's start has died away."""
    whole = scene.rotor.mass + 2 * scene.masses.mass
    start = _SETTLED_WHIRL * 2 * whole / scene.rotor.damping
    start = math.ceil(start / scene.sensor.step) * scene.sensor.step
    first = scene.masses.initial_angle[0]
    return replace(
        scene,
        rotor=replace(scene.rotor, speed_profile=(SpeedPoint(time=0.0, speed=speed),)),
        masses=replace(scene.masses, initial_angle=(first, first + math.pi)),
        supervisor=replace(scene.supervisor, start=start),
        run=replace(scene.run, time_limit=scene.run.time_limit + start),
    )


def _check_rotor(rotor: OneRotor, scene: EccentricScene, found: EccentricRotor) -> None:
    """Faults of what the common rotor asks of this scene's."""
    if found.mass <= 0 or abs(rotor.unbalance) > found.mass * scene.imbalance.radius:
        problem = "these masses, or the imbalance, are heavier than the rotor itself"
        raise _refusal(scene, "masses", "mass", problem, "lighter masses")
    if found.stiffness <= 0 or found.damping <= 0:
        lag = math.degrees(-cmath.phase(rotor.influence))
        problem = f"no bearing of this kind gives a lag of {lag:.4g} deg with this influence coefficient"
        allowed = "a lag_angle above 0 deg and below 180 deg, the greater the lighter the rotor"
        raise _refusal(scene, "rotor", "stiffness", problem, allowed)


def _refusal(scene: AnyScene, table: str, key: str, problem: str, allowed: str) -> SceneError:
    fault = Fault(file=scene.file, table=table, key=key, problem=problem, allowed=allowed)
    return SceneError([fault])
