"""Records of rotor, environment, sensor, controller, run and requirement; the others are in `models`."""

import math
from dataclasses import dataclass
from typing import Annotated, Final, Literal

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import ComplexArray
from ringbalance.scene.keys.declaration import UNCERTAIN, Shown, derived, needed, standard, unused
from ringbalance.scene.keys.derivations import permissible_unbalance, trial_sequence
from ringbalance.scene.keys.fields import (
    NOT_NEGATIVE,
    POSITIVE,
    Angle,
    BalanceGrade,
    Influence,
    Length,
    PositiveLength,
    PositiveMass,
    PositiveShare,
    PositiveTime,
    PositiveUnbalance,
    ProperFraction,
    Time,
    TimePerChamber,
    Turn,
    chamber_letters,
    quantity,
    whole,
)

Shaft = Literal["horizontal", "vertical"]
ControllerKind = Literal["target_vector", "trial", "law_based"]


@dataclass(frozen=True, kw_only=True)
class Environment:
    """Gravity and the direction of the shaft."""

    shaft: Annotated[
        Shaft, standard("horizontal", "how the shaft lies in the field of gravity"), Shown("shaft")
    ]
    gravity: Annotated[
        float,
        quantity("acceleration", NOT_NEGATIVE),
        standard("9.80665 m/s^2", "acceleration of gravity; zero for none"),
        Shown("gravity", "m/s^2"),
    ]


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """The vibration before balancing."""

    amplitude: Annotated[Length, needed("zero-to-peak")]
    phase: Annotated[Turn, needed("of the vibration, with the rotation")]


def _influence(coefficient: float, lag_angle: float) -> complex:
    return complex(coefficient * np.exp(-1j * lag_angle))


@dataclass(frozen=True, kw_only=True)
class Rotor:
    """The rotor as the balancer sees it: V1 = V0 + K U with K = influence_coefficient at minus lag_angle."""

    speed: Annotated[
        float, quantity("speed", POSITIVE), needed("speed of the rotor"), UNCERTAIN, Shown("speed", "rpm")
    ]
    influence_coefficient: Annotated[
        Influence,
        standard(
            "0.0108 um/(g*mm)",
            "zero-to-peak vibration per unbalance; the default is inferred for the paper's rotor",
        ),
        UNCERTAIN,
        Shown("influence coefficient", "um/(g*mm)"),
    ]
    lag_angle: Annotated[
        Turn,
        standard(
            "17 deg",
            "by which the vibration lags behind the unbalance; the default is assumed for the paper's rotor",
        ),
        UNCERTAIN,
        Shown("lag angle", "deg"),
    ]
    initial_amplitude: Annotated[
        float, Shown("vibration at the start", "um", note="zero-to-peak", dimension="length")
    ]
    """Amplitude of the initial vibration, m zero-to-peak."""
    initial_phase: Annotated[float, Shown("its phase", "deg", dimension="angle")]
    """Phase of the initial vibration, rad."""
    mass: Annotated[
        PositiveMass | None,
        unused("no balance quality grade is stated", "of the rotor; for grades of ISO 21940-11 only"),
        Shown("mass", "kg"),
    ] = None

    @property
    def influence(self) -> complex:
        """Vibration per unbalance as a vector, K = kappa exp(-j lag), m/(kg m).

        Source: Eq. 23 of the liquid-ring paper; the sign of the lag is a convention of this program.
        """
        return _influence(self.influence_coefficient, self.lag_angle)

    @property
    def initial_vibration(self) -> complex:
        """Vibration with equal fills in every pair, V0 = v0 exp(j theta0), m zero-to-peak."""
        return complex(self.initial_amplitude * np.exp(1j * self.initial_phase))

    @property
    def initial_unbalance(self) -> complex:
        """Unbalance that causes the initial vibration, V0/K, kg m; the disc's moment is to oppose it."""
        return self.initial_vibration / self.influence

    def vibration(self, moment: npt.ArrayLike) -> ComplexArray:
        """Vibration with the disc's moment U, V1 = V0 + K U, m zero-to-peak.

        Source: Eq. 23 of the liquid-ring paper.
        """
        return np.asarray(self.initial_vibration + self.influence * np.asarray(moment), dtype=np.complex128)


@dataclass(frozen=True, kw_only=True)
class Runout:
    """Runout of the sensor's track on the shaft."""

    amplitude: Annotated[PositiveLength, needed("zero-to-peak")]
    phase: Annotated[
        Turn | None,
        unused(
            "not known: any, drawn for each device; 0 deg in the scene's own run",
            "in the frame of the rotor, with the rotation",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Vibration measurement: standard deviations, zero: exact, and runout, the same in every turn."""

    amplitude_noise: Annotated[
        Length,
        standard("0 um", "standard deviation of the measured amplitude"),
        Shown("amplitude noise", "um"),
    ]
    phase_noise: Annotated[
        Angle, standard("0 deg", "standard deviation of the measured phase"), Shown("phase noise", "deg")
    ]
    runout_amplitude: Annotated[
        float | None, Shown("runout", "um", note="zero-to-peak", dimension="length")
    ] = None
    """m zero-to-peak; None: no runout."""
    runout_phase: Annotated[float | None, Shown("phase of the runout", "deg", dimension="angle")] = None
    """rad; None: not known."""

    @property
    def runout(self) -> complex:
        """Vector that the sensor adds to the rotor's vibration, m zero-to-peak; at 0 rad if not known."""
        return complex((self.runout_amplitude or 0.0) * np.exp(1j * (self.runout_phase or 0.0)))


_DEFAULT_LIMIT_M: Final = 0.05e-6
"""Amplitude below which a controller rests where the scene has no requirement, m."""


def required_amplitude(
    *,
    speed: float,
    influence_coefficient: float,
    mass: float | None,
    residual: float | None,
    grade: float | None,
) -> float | None:
    """Required amplitude, m zero-to-peak: the smaller of `residual` and that of the balance grade.

    The latter is the influence coefficient times the permissible unbalance.
    Args: `mass`: m, kg, without which a grade G, m/s, sets no amplitude.
    Returns: None without a requirement.
    """
    amplitudes = [] if residual is None else [residual]
    if grade is not None and mass is not None:
        unbalance = permissible_unbalance(grade=grade, mass=mass, speed=speed)
        amplitudes.append(unbalance * influence_coefficient)
    return min(amplitudes, default=None)


def _limit(
    speed: float, influence: float, mass: float | None, residual: float | None, grade: float | None
) -> float:
    required = required_amplitude(
        speed=speed, influence_coefficient=influence, mass=mass, residual=residual, grade=grade
    )
    return _DEFAULT_LIMIT_M if required is None else required


@dataclass(frozen=True, kw_only=True)
class ControllerSettings:
    """Settings of the control algorithm."""

    kind: Annotated[
        ControllerKind,
        standard(
            "target_vector", "algorithm; law_based takes the valve-open time straight from the flow law"
        ),
        Shown("algorithm"),
    ]
    limit: Annotated[
        PositiveLength,
        derived(
            "what requirement.residual or requirement.grade leaves; 0.05 um without them",
            "reading (zero-to-peak) below which the controller rests",
            "rotor.speed",
            "rotor.influence_coefficient",
            also=("rotor.mass", "requirement.residual", "requirement.grade"),
            rule=_limit,
        ),
        Shown("limit", "um"),
    ]
    period: Annotated[
        PositiveTime,
        standard(
            "0.5 s", "wait after the gas closes, before the next sample; a run takes at most 10 000 samples"
        ),
        Shown("period", "s"),
    ]
    # Ten samples in a row that are each below the limit with probability 1/2 occur once in a thousand.
    hold_time: Annotated[
        PositiveTime,
        derived(
            "10 times period",
            "the run is settled once the amplitude has stayed at or below limit for this long",
            "controller.period",
            rule=lambda period: 10 * period,
        ),
        Shown("hold time", "s"),
    ]
    proportional: Annotated[
        float,
        quantity("gain", POSITIVE),
        standard("0.08 s/um", "Kc, valve-open time per vibration amplitude"),
        Shown("proportional gain Kc", "s/um", only_for="target_vector"),
    ]
    integral_time: Annotated[
        PositiveTime | None,
        unused("no integral part", "Ti"),
        Shown("integral time Ti", "min", absent="no integral part", only_for="target_vector"),
    ]
    derivative_time: Annotated[
        Time,
        standard("0 s", "Td; zero for no derivative part"),
        Shown("derivative time Td", "min", only_for="target_vector"),
    ]
    minimum_gas_time: Annotated[
        Time, standard("1 ms", "a shorter command is not executed"), Shown("shortest valve-open time", "ms")
    ]
    maximum_gas_time: Annotated[
        PositiveTime,
        standard("5 s", "a longer command is cut to this"),
        Shown("longest valve-open time", "s"),
    ]
    assumed_influence_coefficient: Annotated[
        Influence,
        derived(
            "influence_coefficient of [rotor]", "value used by the controller", "rotor.influence_coefficient"
        ),
        Shown("influence coefficient assumed", "um/(g*mm)"),
    ]
    assumed_lag_angle: Annotated[
        Turn,
        derived("lag_angle of [rotor]", "value used by the controller", "rotor.lag_angle"),
        Shown("lag angle assumed", "deg"),
    ]
    sequence: Annotated[
        tuple[str, ...],
        chamber_letters(),
        derived(
            "each chamber followed by its opposite: A, C, B, D for four",
            "trial algorithm: order of the chambers",
            "disc.chambers",
            rule=trial_sequence,
        ),
        Shown("order of trials", only_for="trial"),
    ]
    gas_time_offset: Annotated[
        TimePerChamber | None,
        unused(
            "nothing is added",
            "target_vector and law_based: added to every valve-open time, such as the dead time in which gas "
            "fills the chamber and liquid rises to the crest; `ringbalance tune` recommends it",
        ),
        Shown("added to valve-open times", "ms", absent="nothing"),
    ] = None
    first_trial: Annotated[
        PositiveTime,
        standard("50 ms", "trial algorithm: valve-open time of a chamber's first trial"),
        Shown("first trial", "ms", only_for="trial"),
    ]
    long_step: Annotated[
        PositiveTime,
        standard("100 ms", "trial algorithm: valve-open time while the amplitude is large"),
        Shown("long step", "ms", only_for="trial"),
    ]
    short_step: Annotated[
        PositiveTime,
        standard("5 ms", "trial algorithm: valve-open time below fine_below"),
        Shown("short step", "ms", only_for="trial"),
    ]
    fine_below: Annotated[
        PositiveLength,
        standard("0.8 um", "trial algorithm: amplitude below which short steps are used"),
        Shown("short steps below", "um", only_for="trial"),
    ]

    @property
    def assumed_influence(self) -> complex:
        """Influence coefficient that the controller assumes, as a vector, m/(kg m)."""
        return _influence(self.assumed_influence_coefficient, self.assumed_lag_angle)

    def offsets(self, chambers: int) -> tuple[float, ...]:
        """`gas_time_offset` of every chamber, s."""
        times = self.gas_time_offset or (0.0,)
        return times * chambers if len(times) == 1 else times


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Seed and end of a simulation."""

    seed: Annotated[
        int, whole(0, 2**63 - 1, highest_text="2^63 - 1"), standard(0, "of all random numbers"), Shown("seed")
    ]
    time_limit: Annotated[PositiveTime, standard("120 s", "end of a simulation"), Shown("time limit", "s")]


@dataclass(frozen=True, kw_only=True)
class RequirementSettings:
    """Requirements of the balancer, and the fraction of drawn devices that must meet them; None: none."""

    settling_time: Annotated[
        PositiveTime | None,
        unused("none is required", "time within which the run must have settled"),
        Shown("settling time required", "s"),
    ] = None
    residual: Annotated[
        PositiveLength | None,
        unused("limit of [controller]", "amplitude (zero-to-peak) of the rotor itself that may remain"),
        Shown("residual amplitude allowed", "um"),
    ] = None
    grade: Annotated[
        BalanceGrade | None,
        unused("none is required", "balance quality grade of ISO 21940-11"),
        Shown("balance quality grade", "mm/s"),
    ] = None
    correction_moment: Annotated[
        PositiveUnbalance | None,
        unused("none is required", "largest unbalance that must be corrected"),
        Shown("unbalance to be corrected", "g*mm"),
    ] = None
    crater: Annotated[
        PositiveShare | None,
        unused(
            "none is required", "largest part of the ring's depth that the gas jet may dig; 1: to the wall"
        ),
        Shown("crater of the gas jet allowed", note="part of the ring's depth"),
    ] = None
    fraction: Annotated[
        ProperFraction,
        standard(0.9, "fraction of the drawn devices that must meet every requirement"),
        Shown("fraction of devices required"),
    ] = 0.9
    phase_range: Annotated[
        Angle,
        standard(
            "180 deg",
            "the phase of the initial vibration lies within this to either side of the scene's; the default "
            "is any phase",
        ),
        Shown("phases of the initial vibration, plus or minus", "deg"),
    ] = math.pi
