"""The frozen, validated, SI-only models that every other room reads.

A scene is made by `ringbalance.scene.load_scene`, which turns units into SI and refuses what is impossible;
these records carry no defaults of their own that a file could contradict.  Angles are radians, positive with
the rotation; amplitudes are zero-to-peak; gas pressures are gauge, vapour pressures absolute.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

HumpGas = Literal["vented", "trapped"]
Entrance = Literal["sharp", "rounded", "projecting"]
Shaft = Literal["horizontal", "vertical"]
GasProcess = Literal["isothermal", "adiabatic"]
ControllerKind = Literal["target_vector", "trial", "law_based"]


@dataclass(frozen=True, kw_only=True)
class Disc:
    """The balancing disc: equal annular chambers between radial plates."""

    outer_radius: float
    """R2, m."""
    inner_radius: float
    """R1, m."""
    axial_width: float
    """B, m."""
    central_angle: float
    """theta of one chamber between its bounding radii, rad."""
    chambers: int
    """Number of chambers, even; chamber i is centred at i * 2 pi / chambers."""
    plate_thickness: float
    """Strip a plate takes on each side of a chamber, m."""
    max_fill_ratio: float
    """Liquid of a pair of opposite chambers, as a share of one chamber's volume."""
    initial_fill: float
    """Fill ratio of every chamber at the start."""


@dataclass(frozen=True, kw_only=True)
class Liquid:
    """The balancing liquid at its working temperature."""

    name: str
    """Name as given, or "custom"."""
    temperature: float | None
    """K; None when the properties were given outright without one."""
    density: float
    """kg/m^3."""
    kinematic_viscosity: float
    """m^2/s."""
    vapour_pressure: float
    """Pa, absolute."""
    density_uncertainty: float
    """95 % half-width, relative to the density."""
    viscosity_uncertainty: float
    """95 % half-width, relative to the kinematic viscosity."""
    source: str
    """Where the properties come from, for the report."""


@dataclass(frozen=True, kw_only=True)
class Bend:
    """One smooth bend of the connecting tube."""

    angle: float
    """rad."""
    radius: float
    """Of the centre line, m."""


@dataclass(frozen=True, kw_only=True)
class Tube:
    """The connecting tube from the port of one chamber, over a hump, to the port of the opposite one."""

    bore: float
    """Inner diameter d, m."""
    port_radius: float
    """Radius at which both ends open, m."""
    hump_radius: float | None
    """Smallest radius on the path, m; None: the paper's straight Eq. 18, always a full siphon."""
    hump_position: float
    """Share of the path at which the hump lies, from the driven chamber."""
    hump_gas: HumpGas
    """Bound used for the priming pressure."""
    length: float
    """Of the centre line with its bends, m."""
    roughness: float
    """Absolute, m."""
    entrance: Entrance
    entrance_radius: float
    """Of a rounded entrance, m; zero otherwise."""
    bends: tuple[Bend, ...]
    """In order along the path from the driven chamber."""
    extra_loss: float
    """Further loss coefficient on the tube's velocity head."""
    drag_coefficient: float | None
    """k by decree, as the paper has it; None: k is calculated."""


@dataclass(frozen=True, kw_only=True)
class Gas:
    """The driving gas; None marks a term that the scene does not ask for."""

    pressure: float
    """Gauge, in the driven chamber while its valve is open, Pa."""
    ambient_pressure: float
    """Absolute, Pa."""
    temperature: float
    """K."""
    conductance: float | None
    """ISO 6358 sonic conductance C, m^3/(s Pa)."""
    critical_ratio: float | None
    """ISO 6358 critical pressure ratio b."""
    dead_volume: float | None
    """Between valve and chamber, m^3."""
    valve_lag: float | None
    """s."""
    process: GasProcess
    """Whether a chamber's gas keeps its temperature while it fills and vents, or takes no heat."""


@dataclass(frozen=True, kw_only=True)
class Environment:
    """Gravity and how the shaft lies in it."""

    shaft: Shaft
    gravity: float
    """m/s^2; zero for none."""


@dataclass(frozen=True, kw_only=True)
class Rotor:
    """The rotor as the balancer sees it: V1 = V0 + K U with K = influence_coefficient at minus lag_angle."""

    speed: float
    """Angular velocity omega, rad/s."""
    influence_coefficient: float
    """kappa, m of vibration per kg m of unbalance."""
    lag_angle: float
    """rad, by which the vibration lags behind the unbalance."""
    initial_amplitude: float
    """m, zero-to-peak."""
    initial_phase: float
    """rad, of the vibration."""


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """Standard deviations of the vibration measurement; zero: exact."""

    amplitude_noise: float
    """m."""
    phase_noise: float
    """rad."""


@dataclass(frozen=True, kw_only=True)
class ControllerSettings:
    """What the scene says of the control algorithm."""

    kind: ControllerKind
    limit: float
    """Amplitude below which the controller rests, m."""
    period: float
    """Wait after the gas closes before the next sample, s."""
    proportional: float
    """Kc, s of gas per m of amplitude."""
    integral_time: float | None
    """Ti, s; None: no integral part."""
    derivative_time: float
    """Td, s."""
    minimum_gas_time: float
    """s; a shorter command is not executed."""
    maximum_gas_time: float
    """s; a longer command is cut."""
    assumed_influence_coefficient: float
    """What the controller believes, m/(kg m)."""
    assumed_lag_angle: float
    """What the controller believes, rad."""
    sequence: tuple[str, ...]
    """Trial algorithm: order of the chambers."""
    first_trial: float
    """Trial algorithm: gas time of a chamber's first trial, s."""
    long_step: float
    """Trial algorithm: gas time while the amplitude is large, s."""
    short_step: float
    """Trial algorithm: gas time below `fine_below`, s."""
    fine_below: float
    """Trial algorithm: amplitude below which short steps are used, m."""


@dataclass(frozen=True, kw_only=True)
class InputUncertainty:
    """95 % half-width of one scene quantity."""

    quantity: str
    """Key, such as "bore" or "lag_angle"."""
    half_width: float
    """Relative when `relative`, else SI."""
    relative: bool


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Seed and end of a simulation."""

    seed: int
    time_limit: float
    """s."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """All that a run needs, in SI units."""

    name: str
    disc: Disc
    liquid: Liquid
    tube: Tube
    gas: Gas
    environment: Environment
    rotor: Rotor
    sensor: Sensor
    controller: ControllerSettings
    uncertainty: tuple[InputUncertainty, ...]
    run: RunSettings
    tolerance: float
    """Relative: bounds discretisation and left-out terms."""
    source: str
    """File name without its folder; for messages and the evidence."""
    sha256: str
    """Of the scene file's bytes."""
    defaulted: tuple[str, ...] = ()
    """Paths such as "rotor.lag_angle" whose value is a default, because the file does not give it."""

    @property
    def balancer(self) -> Literal["liquid_ring"]:
        """Kind of balancer, as the scene file names it."""
        return "liquid_ring"
