"""From a document with `balancer = "eccentric_mass"` to a scene, or to everything that is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ringbalance.scene import eccentric_rules as rules
from ringbalance.scene.build import defaulted, record
from ringbalance.scene.checks import Check, failed_checks
from ringbalance.scene.defaults import Derived, filled_in
from ringbalance.scene.eccentric_models import (
    DrivenMasses,
    EccentricRotor,
    EccentricScene,
    EccentricSensor,
    FineTuning,
    FrictionFilter,
    Imbalance,
    ImbalanceFilter,
    Lqr,
    Motor,
    SpeedPoint,
    Supervisor,
)
from ringbalance.scene.eccentric_schema import EccentricTables
from ringbalance.scene.faults import Fault
from ringbalance.scene.models import RunSettings
from ringbalance.scene.reading import Reading, read_document
from ringbalance.scene.requirements import missing_faults

_FINEST_POSITION = 1e-6
_FINEST_VELOCITY = 1e-5
_FINEST_RATE = 1e-3
_LONGEST_WAIT = 30.0
_BODIES = ("masses.mass", "masses.guide_radius", "rotor.mass")
_STEP = ("sensor.step",)


def _same(value: Any) -> Any:
    return value


def _capacity_travel(mass: float, radius: float, rotor: float) -> float:
    """Greatest static moment of the driven masses over the whole mass, m."""
    return 2 * mass * radius / (rotor + 2 * mass)


def _critical_velocity(travel: float, stiffness: float, rotor: float, mass: float) -> float:
    return travel * math.sqrt(stiffness / (rotor + 2 * mass))


def _settling(damping: float, rotor: float, mass: float) -> float:
    """Eight time constants of the free whirl, s."""
    whole = 2 * (rotor + 2 * mass)
    return _LONGEST_WAIT if damping * _LONGEST_WAIT <= 8 * whole else 8 * whole / damping


def _two_turns(profile: Sequence[SpeedPoint]) -> float:
    speeds = [abs(corner.speed) for corner in profile]
    fastest = speeds[0] or max(speeds) if speeds else 0.0
    return 4 * math.pi / fastest if fastest else 1.0


def _limit(mass: float, radius: float, rotor: float, noise: float) -> float:
    return max(0.02 * _capacity_travel(mass, radius, rotor), 3 * noise)


_DERIVED = (
    Derived(path="imbalance_filter.step", needs=_STEP, rule=_same),
    Derived(
        path="imbalance_filter.position_noise",
        needs=("sensor.position_noise",),
        rule=lambda noise: max(noise, _FINEST_POSITION),
    ),
    Derived(
        path="imbalance_filter.velocity_noise",
        needs=("sensor.velocity_noise",),
        rule=lambda noise: max(noise, _FINEST_VELOCITY),
    ),
    Derived(path="imbalance_filter.initial_position", needs=_BODIES, rule=_capacity_travel),
    Derived(
        path="imbalance_filter.initial_velocity",
        needs=("imbalance_filter.initial_position", "rotor.stiffness", "rotor.mass", "masses.mass"),
        rule=_critical_velocity,
    ),
    Derived(
        path="imbalance_filter.initial_unbalance",
        needs=("masses.mass", "masses.guide_radius"),
        rule=lambda mass, radius: 2 * mass * radius,
    ),
    *(
        Derived(path=f"imbalance_filter.assumed_{key}", needs=(f"rotor.{key}",), rule=_same)
        for key in ("mass", "stiffness", "damping")
    ),
    Derived(path="friction_filter.step", needs=_STEP, rule=_same),
    Derived(
        path="friction_filter.rate_noise",
        needs=("sensor.encoder_rate_noise",),
        rule=lambda noise: max(noise, _FINEST_RATE),
    ),
    Derived(path="friction_filter.initial_rate", needs=("friction_filter.drive_speed",), rule=_same),
    Derived(
        path="friction_filter.initial_friction",
        needs=("masses.guide_radius",),
        rule=lambda radius: radius / 10,
    ),
    Derived(path="lqr.step", needs=_STEP, rule=_same),
    Derived(path="fine_tuning.wait", needs=("rotor.damping", "rotor.mass", "masses.mass"), rule=_settling),
    Derived(path="fine_tuning.average", needs=("rotor.speed_profile",), rule=_two_turns),
    Derived(path="supervisor.limit", needs=(*_BODIES, "sensor.position_noise"), rule=_limit),
)

ECCENTRIC_CHECKS: tuple[Check, ...] = (
    Check(rule=rules.profile_in_order, needs=("rotor.speed_profile",)),
    Check(rule=rules.imbalance_in_rotor, needs=("imbalance.mass", "rotor.mass")),
    Check(rule=rules.masses_fit_track, needs=("masses.arc_length", "masses.guide_radius")),
    Check(
        rule=rules.masses_apart,
        needs=("masses.initial_angle", "masses.arc_length", "masses.guide_radius"),
        moot=(rules.masses_fit_track,),
    ),
    *(
        Check(rule=rules.step_is_multiple, needs=(f"{table}.step", "sensor.step"))
        for table in ("imbalance_filter", "friction_filter", "lqr")
    ),
    Check(rule=rules.moves_in_order, needs=("fine_tuning.stop", "fine_tuning.step")),
    Check(rule=rules.limit_above_position_noise, needs=("supervisor.limit", "sensor.position_noise")),
)


def read_eccentric(document: Mapping[str, Any], *, file: str) -> tuple[Reading, tuple[Fault, ...]]:
    """Read a document with driven masses, with its defaults and cross-checks.

    Args:
        document: as TOML has it.
        file: name of the file, for the faults.

    Returns:
        What could be read, and everything that is wrong.
    """
    reading, faults = read_document(document, file=file, schema=EccentricTables)
    reading = filled_in(reading, _DERIVED)
    return reading, (*faults, *missing_faults(reading), *failed_checks(reading, ECCENTRIC_CHECKS))


def built_eccentric(reading: Reading, *, source: str, sha256: str) -> EccentricScene:
    """Build the scene.

    Args:
        reading: complete and without faults.
        source: file name without its folder.
        sha256: of the file's bytes.

    Returns:
        The scene, in SI.
    """
    profile = tuple(
        SpeedPoint(time=corner.time, speed=corner.speed) for corner in reading.values["rotor.speed_profile"]
    )
    return EccentricScene(
        name=reading.values["name"],
        rotor=record(EccentricRotor, reading, "rotor", speed_profile=profile),
        imbalance=record(Imbalance, reading, "imbalance"),
        masses=record(DrivenMasses, reading, "masses"),
        motor=record(Motor, reading, "motor"),
        sensor=record(EccentricSensor, reading, "sensor"),
        imbalance_filter=record(ImbalanceFilter, reading, "imbalance_filter"),
        friction_filter=record(FrictionFilter, reading, "friction_filter"),
        lqr=record(Lqr, reading, "lqr"),
        fine_tuning=record(FineTuning, reading, "fine_tuning"),
        supervisor=record(Supervisor, reading, "supervisor"),
        run=record(RunSettings, reading, "run"),
        tolerance=reading.values["accuracy.tolerance"],
        source=source,
        sha256=sha256,
        defaulted=defaulted(reading),
    )
