"""Frozen, validated records of a scene with two eccentric masses, in SI units; its tables and rules.

Angles are radians in the rotor's frame, positive with the rotation; amplitudes are zero-to-peak.  A walk is
the standard deviation after 1 s of a random walk, so its square is a spectral density: unit^2 / s.  The
annotation of a field gives unit, range and meaning of its key, see `ringbalance.scene.keys.declaration`.
Loaded for such a scene only.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Final, Literal

import numpy as np

from ringbalance.controller.eccentric_mass.control_records import (
    FineTuning,
    FrictionFilter,
    ImbalanceFilter,
    Lqr,
    Supervisor,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.keys.declaration import UNCERTAIN, Entries, Listed, needed, standard, unused
from ringbalance.scene.keys.fields import (
    NOT_NEGATIVE,
    POSITIVE,
    Angle,
    Angles,
    Arms,
    BalanceGrade,
    Damping,
    Inertia,
    Length,
    Mass,
    OneLine,
    PositiveLength,
    PositiveMass,
    PositiveTime,
    ProperFraction,
    Rate,
    Stiffness,
    Teeth,
    Turn,
    Velocity,
    each_of,
    quantity,
    whole,
)
from ringbalance.scene.keys.schema import ORIGIN, Schema, TableSchema
from ringbalance.scene.kinds import (
    Check,
    Contradiction,
    SceneKind,
    check,
    condition,
    limit_above_noise,
    reader_of,
    written,
)
from ringbalance.scene.narrowing import scene_as
from ringbalance.scene.origins import SceneFile

STEADY_RAD_S2: Final = 1e-6
"""Speed rate below which the speed counts as constant."""
Frame = Literal["rotor", "laboratory"]


@dataclass(frozen=True, kw_only=True)
class SpeedPoint:
    """One corner of the speed profile."""

    time: Annotated[float, quantity("time", NOT_NEGATIVE), needed("from the start of the run")]
    speed: Annotated[
        float, quantity("speed"), needed("of the rotor; negative against the sense in which angles count")
    ]


@dataclass(frozen=True, kw_only=True)
class EccentricRotor:
    """A rigid planar rotor on an isotropic linear bearing."""

    mass: Annotated[
        PositiveMass,
        needed("m_r of the rotor with its imbalance, without the two eccentric masses"),
        UNCERTAIN,
    ]
    stiffness: Annotated[Stiffness, needed("K_B of the isotropic bearing"), UNCERTAIN]
    damping: Annotated[Damping, needed("C_B of the isotropic bearing"), UNCERTAIN]
    speed_profile: Annotated[
        tuple[SpeedPoint, ...],
        needed("list of { time, speed }; the speed is linear in between, and constant before and after"),
        Listed('[{ time = "0 s", speed = "100 rpm" }, ...]'),
    ]

    @property
    def profile(self) -> tuple[FloatArray, FloatArray]:
        """Times, s, and speeds, rad/s, of the corners of the speed profile."""
        times = np.array([corner.time for corner in self.speed_profile])
        return times, np.array([corner.speed for corner in self.speed_profile])

    @property
    def plateaus(self) -> FloatArray:
        """Speeds that the profile keeps for a time, rad/s, each once, shape (n,)."""
        times, speeds = self.profile
        level = np.abs(np.diff(speeds)) < STEADY_RAD_S2 * np.diff(times)
        first = speeds[:1] if times[0] > 0 else speeds[:0]
        return np.unique(np.concatenate([first, speeds[:-1][level], speeds[1:][level], speeds[-1:]]))


@dataclass(frozen=True, kw_only=True)
class Imbalance:
    """The imbalance of the rotor."""

    mass: Annotated[Mass, needed("m_im; a part of the rotor's mass"), UNCERTAIN]
    radius: Annotated[PositiveLength, needed("r_im, of the imbalance"), UNCERTAIN]
    phase: Annotated[Turn, needed("phi_m, of the imbalance in the rotor's frame"), UNCERTAIN]


@dataclass(frozen=True, kw_only=True)
class EccentricMasses:
    """Two equal masses on one circular track."""

    mass: Annotated[PositiveMass, needed("m_b of each"), UNCERTAIN]
    guide_radius: Annotated[PositiveLength, needed("r_b of the circular track"), UNCERTAIN]
    arc_length: Annotated[PositiveLength, needed("l of each along the track: the masses cannot come closer")]
    initial_angle: Annotated[
        Angles, standard(["0 deg", "180 deg"], "phi of each at the start, in the rotor's frame")
    ]
    friction_arm: Annotated[
        Arms,
        standard(
            ["0 mm", "0 mm"],
            "mu_f of each, a length: friction torque = mu_f m_b r_b (rotor speed + mass's own speed)^2",
        ),
        UNCERTAIN,
    ]

    @property
    def gap(self) -> float:
        """Angle that one mass occupies on the track, rad."""
        return self.arc_length / self.guide_radius


@dataclass(frozen=True, kw_only=True)
class Motor:
    """Motor and gears of one eccentric mass."""

    torque_constant: Annotated[
        float, quantity("torque_constant", POSITIVE), needed("K_i, motor torque per current"), UNCERTAIN
    ]
    back_emf_constant: Annotated[
        float,
        quantity("voltage_per_speed", NOT_NEGATIVE),
        needed("K_m, voltage per speed of the motor"),
        UNCERTAIN,
    ]
    resistance: Annotated[float, quantity("resistance", POSITIVE), needed("R_m of the winding"), UNCERTAIN]
    motor_inertia: Annotated[Inertia, needed("J_1 of motor and gear A"), UNCERTAIN]
    gear_inertia: Annotated[Inertia, needed("J_2 of gear B"), UNCERTAIN]
    teeth: Annotated[Teeth, needed("N_1 of gear A on the motor, N_2 of gear B, N_3 of the fixed gear C")]
    maximum_voltage: Annotated[
        float | None, quantity("voltage", POSITIVE), unused("no limit", "a larger command is cut to this")
    ]


@dataclass(frozen=True, kw_only=True)
class MotorAtHand:
    """A motor that [design] may choose; it travels with its mass, which is no lighter."""

    name: Annotated[OneLine, needed("as it is ordered")]
    torque_constant: Annotated[float, quantity("torque_constant", POSITIVE), needed("K_i")]
    resistance: Annotated[float, quantity("resistance", POSITIVE), needed("R_m of the winding")]
    inertia: Annotated[Inertia, needed("of its rotor")]
    mass: Annotated[PositiveMass, needed("of the motor")]
    maximum_voltage: Annotated[float, quantity("voltage", POSITIVE), needed("of the motor or its supply")]
    back_emf_constant: Annotated[
        float | None,
        quantity("voltage_per_speed", NOT_NEGATIVE),
        unused("as large as torque_constant, in SI", "K_m"),
    ] = None


@dataclass(frozen=True, kw_only=True)
class EccentricDesign:
    """Choices of `ringbalance design`, which sizes masses and gears in any case."""

    guide_radius: Annotated[
        PositiveLength | None,
        unused("the track keeps its radius", "largest guide radius that space leaves"),
    ] = None
    mass: Annotated[
        PositiveMass | None,
        unused("as heavy as the imbalance needs", "largest mass of each that space leaves"),
    ] = None
    motors: Annotated[
        tuple[MotorAtHand, ...],
        standard([], "motors at hand; without any, and without `motor_file`, the scene's own stays"),
        Listed(
            '[{ name = "M1", torque_constant = "10 mN*m/A", resistance = "2 ohm", inertia = "5 g*cm^2", '
            'mass = "40 g", maximum_voltage = "12 V" }, ...]'
            ', or motor_file = "motors.csv" in place of the list'
        ),
    ] = ()
    motor_file: Annotated[
        OneLine | None,
        unused("those of `motors`", "a CSV file with the keys of `motors` in its columns, beside the scene"),
    ] = None
    teeth: Annotated[
        tuple[int, ...],
        each_of(whole(1, 100000), example="[10, 15, 20]"),
        standard([], "numbers of teeth that gear A may have; without any, the scene's to four times as many"),
    ] = ()


@dataclass(frozen=True, kw_only=True)
class EccentricSensor:
    """Sensors of vibration and masses: frame, noise and step."""

    frame: Annotated[
        Frame, standard("rotor", "frame in which the sensors measure the rotor's position and velocity")
    ]
    position_noise: Annotated[Length, standard("0 mm", "standard deviation of each measured coordinate")]
    velocity_noise: Annotated[Velocity, standard("0 mm/s", "standard deviation of each measured velocity")]
    encoder_noise: Annotated[Angle, standard("0 deg", "standard deviation of the measured angle of a mass")]
    encoder_rate_noise: Annotated[
        Rate, standard("0 rad/s", "standard deviation of the measured speed of a mass")
    ]
    step: Annotated[PositiveTime, standard("1 ms", "time between two samples, the step of the whole loop")]


@dataclass(frozen=True, kw_only=True)
class EccentricRequirement:
    """Requirements of the balancer (None: not required), and the fraction of devices that must meet them."""

    settling_time: Annotated[
        PositiveTime | None,
        unused(
            "until the speed changes or the run ends",
            "time, from the start of balancing, within which the run must have settled",
        ),
    ] = None
    residual: Annotated[
        PositiveLength | None,
        unused("limit of [supervisor]", "vibration amplitude (zero-to-peak) that may remain at the end"),
    ] = None
    grade: Annotated[
        BalanceGrade | None,
        unused(
            "none is required", "balance quality grade of ISO 21940-11, of the rotor at the end of the run"
        ),
    ] = None
    fraction: Annotated[
        ProperFraction,
        standard(0.9, "fraction of the drawn devices that must meet every requirement"),
    ] = 0.9
    phase_range: Annotated[
        Angle,
        standard(
            "180 deg",
            "the phase of the imbalance lies within this to either side of the scene's; the default is any "
            "phase",
        ),
    ] = math.pi


@dataclass(frozen=True, kw_only=True, repr=False)
class EccentricScene(SceneFile):
    """Scene of a run with two eccentric masses, in SI units.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("driven_masses_small"))
        >>> type(scene).__name__, round(scene.rotor.mass, 3)
        ('EccentricScene', 5.0)
    """

    rotor: EccentricRotor
    imbalance: Imbalance
    masses: EccentricMasses
    motor: Motor
    sensor: EccentricSensor
    imbalance_filter: ImbalanceFilter
    friction_filter: FrictionFilter
    lqr: Lqr
    fine_tuning: FineTuning
    supervisor: Supervisor
    requirement: EccentricRequirement = field(default_factory=EccentricRequirement)
    design: EccentricDesign = field(default_factory=EccentricDesign)

    balancer: ClassVar[str] = "eccentric_mass"

    @property
    def samples(self) -> int:
        """Number of samples of a run that does not diverge."""
        return round(self.run.time_limit / self.sensor.step) + 1

    @property
    def mean_noise(self) -> float:
        """Noise of the mean of a check or a trial (95 %), m."""
        return 2 * self.sensor.position_noise / math.sqrt(max(self.fine_tuning.average / self.sensor.step, 1))

    @property
    def steady_until(self) -> float | None:
        """Time at which the speed first changes, s; None if it is constant to the end of the run."""
        corners = pairwise(self.rotor.speed_profile)
        changes = [corner.time for corner, after in corners if corner.speed != after.speed]
        return changes[0] if changes and 0 < changes[0] < self.run.time_limit else None


def eccentric_scene(scene: SceneFile) -> EccentricScene:
    """Narrow a scene to one whose balancer is two eccentric masses. Raises: SceneError: another balancer."""
    return scene_as(EccentricScene, scene)


_TABLES = {
    "rotor": TableSchema.of(EccentricRotor, "the rotor on its bearing, and its speed"),
    "imbalance": TableSchema.of(Imbalance, "the imbalance to be balanced"),
    "masses": TableSchema.of(EccentricMasses, "the two eccentric masses on their track"),
    "motor": TableSchema.of(Motor, "motor and gears of each mass"),
    "sensor": TableSchema.of(EccentricSensor, "the sensors; exact when left out"),
    "imbalance_filter": TableSchema.of(ImbalanceFilter, "the Kalman filter that finds the imbalance"),
    "friction_filter": TableSchema.of(FrictionFilter, "the extended Kalman filter that finds the friction"),
    "lqr": TableSchema.of(Lqr, "the regulator that moves the masses"),
    "supervisor": TableSchema.of(Supervisor, "the order of the stages, and when each ends"),
    "fine_tuning": TableSchema.of(FineTuning, "the search by trial for a smaller vibration"),
    "requirement": TableSchema.of(EccentricRequirement, "what is required of the balancer"),
    "design": TableSchema.of(EccentricDesign, "what `ringbalance design` may choose"),
}
ECCENTRIC_MASS = Schema.of(
    _TABLES,
    balancer=needed('"eccentric_mass" for eccentric masses'),
    scene=EccentricScene,
)
"""A scene whose balancer is two eccentric masses."""


_ROUNDING_FRACTION = 1e-9


def _imbalance_in_rotor(imbalance: float, rotor: float) -> Contradiction | None:
    """m_im <= m_r, since the imbalance is a part of the rotor."""
    if imbalance <= rotor:
        return None
    limit = written(rotor, "kg")
    return Contradiction(
        problem=f"the imbalance is a part of the rotor's mass ({limit}), so it cannot be heavier",
        allowed=f"at least 0 kg and at most {limit}",
    )


def _profile_in_order(profile: tuple[SpeedPoint, ...]) -> Contradiction | None:
    """The profile has a corner, and its times increase."""
    allowed = "at least one { time, speed }, in order of time, each time once"
    if not profile:
        return Contradiction(problem="it has no entry", allowed=allowed)
    for number, (before, after) in enumerate(pairwise(profile), start=2):
        if after.time <= before.time:
            late, early = written(after.time, "s"), written(before.time, "s")
            problem = f"entry {number} ({late}) does not come after the one before ({early})"
            return Contradiction(problem=problem, allowed=allowed)
    return None


def _step_is_multiple(step: float, base: float) -> Contradiction | None:
    """Each step is a whole multiple of the sensor's step."""
    times = round(step / base)
    if times >= 1 and abs(step / base - times) <= 1e-6 * times:
        return None
    first, second, third = (written(count * base, "s") for count in (1, 2, 3))
    return Contradiction(
        problem=f"it is not a whole multiple of the step of [sensor] ({first})",
        allowed=f"{first}, {second}, {third} ...",
    )


def _width_checks() -> Iterator[Check]:
    """Yield a rule for each table: no stated uncertainty exceeds its quantity; angles are exempt from it."""
    for table, key in ECCENTRIC_MASS.tables["uncertainty"].keys.items():
        if table == ORIGIN or not isinstance(key.takes, Entries):
            continue
        names = tuple(name for name in key.takes.keys if name != "phase")

        def below(widths: Mapping[str, tuple[float, bool]], *values: Any, names: Any = names) -> Any:
            for name, value in zip(names, values, strict=True):
                width, relative = widths.get(name, (0.0, True))
                if not relative and width > np.min(value):
                    return Contradiction(
                        problem=f"the uncertainty of {name} is larger than {name} itself",
                        allowed="at most the quantity itself, or below 100 %",
                    )
            return None

        yield check(below, f"uncertainty.{table}", *(f"{table}.{name}" for name in names))


_ARC, _GUIDE = "masses.arc_length", "masses.guide_radius"
_STEPS = ("imbalance_filter.step", "friction_filter.step", "lqr.step")

CHECKS: tuple[Check, ...] = (
    check(_profile_in_order, "rotor.speed_profile"),
    check(_imbalance_in_rotor, "imbalance.mass", "rotor.mass"),
    condition(
        "masses_fit_track",
        *(_ARC, _GUIDE),
        more=lambda v: {"most": math.pi * v.guide_radius},
        holds=lambda v: v.arc_length <= v.most * (1 + _ROUNDING_FRACTION),
        problem="two masses of this length do not fit on the track",
        allowed="above 0 mm and at most pi * guide_radius = {most:mm}",
    ),
    condition(
        "masses_apart",
        *("masses.initial_angle", _ARC, _GUIDE),
        more=lambda v: {
            "apart": abs(math.remainder(v.initial_angle[0] - v.initial_angle[1], 2 * math.pi)),
            "width": v.arc_length / v.guide_radius,
        },
        holds=lambda v: v.apart >= v.width * (1 - _ROUNDING_FRACTION),
        problem="the masses overlap: they are {apart:deg} apart, each {width:deg} wide",
        allowed="angles at least arc_length / guide_radius = {width:deg} apart",
        moot=("masses_fit_track",),
    ),
    *(check(_step_is_multiple, step, "sensor.step") for step in _STEPS),
    condition(
        "moves_in_order",
        *("fine_tuning.stop", "fine_tuning.step"),
        holds=lambda v: v.stop <= v.step,
        problem="the smallest trial move must not be longer than the first, step ({step:deg})",
        allowed="above 0 deg and at most {step:deg}",
    ),
    limit_above_noise("supervisor.limit", "sensor.position_noise", "mm"),
    *_width_checks(),
)

KIND: Final = SceneKind(
    schema=ECCENTRIC_MASS,
    read=reader_of(ECCENTRIC_MASS, CHECKS),
    main=(
        ("rotor.mass", "rotor.stiffness", "rotor.damping"),
        ("imbalance.mass", "imbalance.radius", "masses.mass", "masses.guide_radius"),
        ("supervisor.limit", "run.seed"),
    ),
    usual_units={"angle": "deg", "length": "mm"},
)
"""Scenes whose balancer is two eccentric masses."""
