"""Test rigs by a simulator that shares no code with the program: numpy and scipy alone.

A rig is a scene file as its designer writes it, the device that was built, with every stated input drawn from
what the scene states of it, and files of what was read on it.  k(u) is by other sources than the program's:
Haaland's friction factor, Ito and Nanbu's factors of rotation, K of entrance and bends as handbooks have them,
each with an error of its own that is drawn.  Readings are rounded as instruments show them, and the gauge of
the gas is off by a constant.

An injection is the one-dimensional momentum of liquid in the tube, in three parts:
1. the front rises from the level of the chamber over the crest and down to the level of the other one,
2. a full column is driven by gas and levels (its pressure over the crest is checked: it does not separate),
3. gas off, it parts over the crest; what is upstream coasts to rest.  What has passed the crest's middle has
   been moved, the rest falls back.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

FloatArray = npt.NDArray[np.float64]
TWO_SIGMA: Final = 1.959964
AMBIENT: Final = 101325.0
LETTERS: Final = "ABCDEFGH"
_LAMINAR_ENDS: Final = 1.83
"""Of 2.33 in all, for an entrance loss of 0.50."""


@dataclass(frozen=True, kw_only=True)
class Device:
    """Everything that the simulator needs, SI."""

    outer_radius: float
    inner_radius: float
    axial_width: float
    central_angle: float
    chambers: int
    fill: float
    density: float
    kinematic_viscosity: float
    bore: float
    length: float
    roughness: float
    extra_loss: float
    crest_radius: float
    bends: int
    pressure: float
    speed: float
    influence_coefficient: float
    lag_angle: float
    lambda_factor: float = 1.0
    pressure_offset: float = 0.0
    """Of the liquid's gas over what the gauge shows, Pa."""
    friction_factor: float = 1.0
    """On f, an error of the foreign law like the next three."""
    rotation_factor: float = 1.0
    """On what rotation adds to f."""
    entrance_loss: float = 0.50
    bend_loss: float = 0.28

    @property
    def area(self) -> float:
        """Of the bore."""
        return math.pi * self.bore**2 / 4

    @property
    def volume(self) -> float:
        """Of one chamber, a sector."""
        ring = self.outer_radius**2 - self.inner_radius**2
        return self.central_angle / 2 * ring * self.axial_width

    def level(self, fill: float) -> float:
        """Radius of the free surface."""
        ring = self.outer_radius**2 - self.inner_radius**2
        return math.sqrt(self.outer_radius**2 - fill * ring)

    def head(self, radius: float) -> float:
        """Pressure of a column from a radius to the outer wall, Pa."""
        return self.density * self.speed**2 * (self.outer_radius**2 - radius**2) / 2

    def moment(self, fill: float) -> float:
        """Of one chamber's liquid, kg m."""
        cubes = self.outer_radius**3 - self.level(fill) ** 3
        arm = math.sin(self.central_angle / 2) * 2 / 3 * cubes
        return self.lambda_factor * self.density * self.axial_width * arm

    @property
    def arc(self) -> float:
        """Share of the path on the circle of the crest, between two straight legs that touch it."""
        turn = 2 * math.acos(self.crest_radius / self.outer_radius)
        arc = self.crest_radius * (math.pi - turn)
        return arc / (arc + 2 * math.sqrt(self.outer_radius**2 - self.crest_radius**2))

    def path_radius(self, share: float) -> float:
        """At a share of the path, the crest in its middle."""
        out = max(abs(share - 0.5) - self.arc / 2, 0.0) / ((1 - self.arc) / 2)
        return math.sqrt(self.crest_radius**2 + (self.outer_radius**2 - self.crest_radius**2) * out**2)

    def share_at(self, radius: float) -> float:
        """Share of the near leg at which it passes a radius."""
        squares = (radius**2 - self.crest_radius**2) / (self.outer_radius**2 - self.crest_radius**2)
        return (1 - self.arc) / 2 * (1 - math.sqrt(max(squares, 0.0)))

    def friction(self, velocity: float) -> float:
        """f of the tube where it turns; straight at rest."""
        reynolds = max(abs(velocity), 1e-3) * self.bore / self.kinematic_viscosity
        rotation = self.speed * self.bore**2 / self.kinematic_viscosity
        rough = (self.roughness / self.bore / 3.7) ** 1.11
        laminar = 64 / reynolds
        turbulent = (-1.8 * math.log10(rough + 6.9 / max(reynolds, 1000.0))) ** -2
        if rotation > 0:
            laminar *= 1 + self.rotation_factor * (laminar_factor(rotation * reynolds) - 1)
            turbulent *= 1 + self.rotation_factor * (turbulent_factor(rotation**2 / reynolds) - 1)
        part = min(max((reynolds - 2300) / 1700, 0.0), 1.0)
        return self.friction_factor * ((1 - part) * laminar + part * turbulent)

    def losses(self, velocity: float) -> tuple[float, float]:
        """What is lost at the near port with the stream's own kinetic energy, and spread along the path,
        over u^2/2; that at the far port is 1, and more in laminar flow."""
        reynolds = max(abs(velocity), 1e-3) * self.bore / self.kinematic_viscosity
        near = self.entrance_loss + (1.05 if reynolds > 2300 else _LAMINAR_ENDS)
        along = self.friction(velocity) * self.length / self.bore + self.extra_loss
        return near + self.bend_loss * self.bends / 2, along

    def loss(self, velocity: float) -> float:
        """k + 1 of the whole tube; both ends of laminar flow together 2.33 as handbooks have it (Hagenbach)."""
        reynolds = max(abs(velocity), 1e-3) * self.bore / self.kinematic_viscosity
        ends = self.entrance_loss + (1.0 if reynolds > 2300 else _LAMINAR_ENDS)
        return ends + self.bend_loss * self.bends + self.losses(velocity)[1]


def laminar_factor(kl: float) -> float:
    """On f of laminar flow. Source: Ito and Nanbu, J. Basic Eng. 93 (1971) 383."""
    return max(0.0883 * kl**0.25 * (1 + 11.2 * kl**-0.325), 1.0) if kl > 220 else 1.0


def turbulent_factor(kt: float) -> float:
    """The same of turbulent flow."""
    if kt < 1:
        return 1.0
    return 0.942 + 0.058 * kt**0.282 if kt < 500 else 0.942 * kt**0.05


def injected(device: Device, fill: float, gauge: float, gas_time: float) -> float:
    """Fill that leaves a chamber by one injection, of a pair that is at rest before and after."""
    gas = gauge + device.pressure_offset
    start = device.share_at(device.level(fill))
    far = 1 - device.share_at(device.level(2 * device.fill - fill))
    rate = device.area / device.volume
    rising = _run(_rising(device, fill, gas, start), [start, 0.0], gas_time, until=lambda y: y[0] - far)
    if rising.t[-1] >= gas_time or not rising.t_events[0].size:
        raise ValueError("the valve closes before the tube is full: no injection of these rigs is so short")
    moved = (far - start) * device.length * rate
    full = _run(_full(device, fill, gas), [moved, float(rising.y[1, -1])], gas_time - float(rising.t[-1]))
    _check_column(device, fill, gas, full.y)
    parted = _run(_parted(device, fill), [float(v) for v in full.y[:, -1]], 1.0, until=lambda y: y[1] - 1e-3)
    passed_middle = float(parted.y[0, -1]) - (0.5 - start) * device.length * rate
    return passed_middle


def _run(
    rates: Callable[[float, FloatArray], list[float]],
    state: list[float],
    time: float,
    until: Callable[[FloatArray], float] | None = None,
) -> Any:
    def event(_: float, y: FloatArray) -> float:
        return -1.0 if until is None else float(until(y))

    event.terminal = True  # type: ignore[attr-defined]
    return solve_ivp(rates, (0.0, time), state, events=event, rtol=1e-7, atol=1e-9)


def _rising(
    device: Device, fill: float, gas: float, start: float
) -> Callable[[float, FloatArray], list[float]]:
    """Of the share of the path that is full, and the velocity."""

    def rates(_: float, y: FloatArray) -> list[float]:
        share, u = float(y[0]), float(y[1])
        now = fill - (share - start) * device.length * device.area / device.volume
        near, along = device.losses(u)
        push = gas + device.head(device.level(now)) - device.head(device.path_radius(share))
        mass = device.density * (share * device.length + device.bore)
        return [u / device.length, (push - device.density * (near + along * share) * u * abs(u) / 2) / mass]

    return rates


def _full(device: Device, fill: float, gas: float) -> Callable[[float, FloatArray], list[float]]:
    """Of the fill moved, and the velocity."""
    total, mass = 2 * device.fill, device.density * device.length

    def rates(_: float, y: FloatArray) -> list[float]:
        moved, u = float(y[0]), float(y[1])
        near, far = device.level(fill - moved), device.level(total - fill + moved)
        push = gas + device.head(near) - device.head(far)
        return [
            u * device.area / device.volume,
            (push - device.density * device.loss(u) * u * abs(u) / 2) / mass,
        ]

    return rates


def _parted(device: Device, fill: float) -> Callable[[float, FloatArray], list[float]]:
    """The same without gas, a cavity over the crest at half of ambient pressure."""

    def rates(_: float, y: FloatArray) -> list[float]:
        moved, u = float(y[0]), float(y[1])
        near, along = device.losses(u)
        push = device.head(device.level(fill - moved)) - device.head(device.crest_radius) + AMBIENT / 2
        lost = device.density * (near + along / 2) * u * abs(u) / 2
        return [u * device.area / device.volume, (push - lost) / (device.density * device.length / 2)]

    return rates


def _check_column(device: Device, fill: float, gas: float, path: FloatArray) -> None:
    """A full column whose pressure behind the crest's arc fell below that around it might separate there,
    and one that is as high without gas would not part: neither is what this simulator describes."""
    moved, u = path
    end = 0.5 + device.arc / 2
    level = np.array([device.head(device.level(fill - m)) for m in moved])
    lost = np.array([sum(device.losses(v)[i] * (1, end)[i] for i in (0, 1)) for v in u])
    over = gas + level - device.head(device.crest_radius) - device.density * lost * u**2 / 2
    if over[-1] < 0 or level[-1] - device.head(device.crest_radius) > -AMBIENT:
        raise ValueError(f"no full column: {over[-1]:.3g} Pa over the crest, {level[-1]:.3g} Pa of level")


@dataclass(frozen=True, kw_only=True)
class Rig:
    """What a designer writes, what was built, and what was read, as texts of files."""

    machine: str
    scene: str
    files: dict[str, str]
    device: Device


_WATER: Final = Device(
    outer_radius=0.060,
    inner_radius=0.025,
    axial_width=0.060,
    central_angle=math.radians(84),
    chambers=4,
    fill=0.25,
    density=998.2,
    kinematic_viscosity=1.0e-6,
    bore=1.8e-3,
    length=0.180,
    roughness=1.5e-6,
    extra_loss=0.3,
    crest_radius=0.0395,
    bends=2,
    pressure=1.4e6,
    speed=6000 * math.pi / 30,
    influence_coefficient=0.004,
    lag_angle=0.4,
)
MACHINES: Final = {
    "water, fast": _WATER,
    "water, six chambers": replace(
        _WATER,
        outer_radius=0.090,
        inner_radius=0.045,
        axial_width=0.040,
        central_angle=math.radians(56),
        chambers=6,
        bore=2.5e-3,
        length=0.225,
        crest_radius=0.050,
        pressure=1.1e6,
        speed=3000 * math.pi / 30,
        influence_coefficient=0.002,
    ),
    "oil": replace(
        _WATER,
        outer_radius=0.090,
        inner_radius=0.045,
        axial_width=0.040,
        central_angle=math.radians(84),
        density=965.0,
        kinematic_viscosity=1.0e-4,
        bore=4.0e-3,
        length=0.225,
        crest_radius=0.050,
        bends=0,
        pressure=0.9e6,
        speed=3000 * math.pi / 30,
        influence_coefficient=0.002,
    ),
}
"""As designed."""
_RELATIVE: Final = {
    "density": 0.002,
    "kinematic_viscosity": 0.03,
    "roughness": 0.5,
    "influence_coefficient": 0.07,
    "speed": 0.001,
}
_ABSOLUTE: Final = {
    "outer_radius": 5e-5,
    "inner_radius": 5e-5,
    "axial_width": 1e-4,
    "length": 2e-3,
    "lag_angle": math.radians(3),
    "crest_radius": 2e-4,
    "pressure_offset": 1e4,
    "lambda_factor": 0.05,
}
"""What the scene states, expanded (95 %)."""
KINDS: Final = (
    ("trial_weight", "injection"),
    ("trial_weight", "flow", "injection"),
    ("trial_weight", "transfer", "injection"),
    ("trial_weight", "transfer", "flow", "injection"),
)


def rig(number: int) -> Rig:
    """One rig; all draws follow from its number."""
    random = np.random.default_rng([4711, number])
    names = list(MACHINES)
    machine = names[number % len(names)]
    designed = MACHINES[machine]
    device = _built(designed, random)
    kinds = KINDS[number // len(names) % len(KINDS)]
    files = {f"{kind}.csv": _RECORDS[kind](designed, device, random) for kind in kinds}
    return Rig(machine=machine, scene=_scene_text(machine, designed), files=files, device=device)


def _built(designed: Device, random: np.random.Generator) -> Device:
    widths = {name: share * getattr(designed, name) for name, share in _RELATIVE.items()}
    widths |= _ABSOLUTE | {"bore": 0.03 * designed.bore}
    drawn = {
        name: getattr(designed, name) + width / TWO_SIGMA * random.standard_normal()
        for name, width in widths.items()
    }
    return replace(
        designed,
        **drawn,
        extra_loss=random.uniform(0.1, 1.0),
        friction_factor=1 + 0.02 * random.standard_normal(),
        rotation_factor=1 + 0.20 * random.standard_normal(),
        entrance_loss=0.50 + 0.05 * random.standard_normal(),
        bend_loss=0.28 + 0.07 * random.standard_normal(),
    )


def _scene_text(machine: str, d: Device) -> str:
    relative = "\n".join(f'{name} = "{100 * share:g} %"' for name, share in _RELATIVE.items())
    return f"""name = "{machine}"
[disc]
outer_radius = "{1e3 * d.outer_radius:.6g} mm"
inner_radius = "{1e3 * d.inner_radius:.6g} mm"
axial_width = "{1e3 * d.axial_width:.6g} mm"
central_angle = "{math.degrees(d.central_angle):.6g} deg"
chambers = {d.chambers}
lambda_factor = 1.0
[liquid]
name = "{machine}"
density = "{d.density:.6g} kg/m^3"
kinematic_viscosity = "{1e6 * d.kinematic_viscosity:.6g} cSt"
[tube]
bore = "{1e3 * d.bore:.6g} mm"
length = "{1e3 * d.length:.6g} mm"
hump_radius = "{1e3 * d.crest_radius:.6g} mm"
roughness = "{1e6 * d.roughness:.6g} um"
bends = [{", ".join(['{ angle = "90 deg", radius = "3 mm" }'] * d.bends)}]
extra_loss = {d.extra_loss}
[gas]
pressure = "{1e-6 * d.pressure:.6g} MPa"
[environment]
gravity = "0 m/s^2"
[rotor]
speed = "{d.speed * 30 / math.pi:.6g} rpm"
influence_coefficient = "{1e6 * 1e-6 * d.influence_coefficient:.6g} um/(g*mm)"
lag_angle = "{math.degrees(d.lag_angle):.6g} deg"
[uncertainty]
{relative}
bore = "{1e3 * 0.03 * d.bore:.6g} mm"
outer_radius = "0.05 mm"
inner_radius = "0.05 mm"
axial_width = "0.1 mm"
length = "2 mm"
lag_angle = "3 deg"
hump_radius = "0.2 mm"
pressure = "10 kPa"
lambda_factor = 0.05
"""


def _text(kind: str, head: str, rows: Sequence[str], *, amplitude: bool = False) -> str:
    convention = '# amplitude = "zero_to_peak"\n' if amplitude else ""
    first = f'# kind = "{kind}"\n# source = "a simulator of its own"\n{convention}'
    return first + "\n".join([f"{head},note", *(f"{row},{i}" for i, row in enumerate(rows))]) + "\n"


def _read(vibration: complex, noise: float, random: np.random.Generator) -> str:
    """Amplitude, um, and phase, deg, as an instrument shows them."""
    seen = vibration + noise * complex(random.standard_normal(), random.standard_normal())
    return f"{1e6 * abs(seen):.3f},{math.degrees(np.angle(seen)):.2f}"


def _response(device: Device) -> complex:
    """m over kg m."""
    return complex(device.influence_coefficient * np.exp(-1j * device.lag_angle))


def _trial_weights(designed: Device, device: Device, random: np.random.Generator) -> str:
    weight = 4e-6 / designed.influence_coefficient
    start, noise = 1e-5 * np.exp(1j * random.uniform(0, 6)), random.uniform(1e-8, 6e-8)
    rows = []
    for size, angle in ((0, 0), (1, 0), (1, 120), (1, 240), (2, 60), (2, 180)):
        force = size * weight * np.exp(1j * math.radians(angle))
        seen = _read(start + _response(device) * force, noise, random)
        rows.append(f"{1e6 * size * weight:.6g},{angle},{seen}")
    return _text("trial_weight", "unbalance [g*mm],angle [deg],amplitude [um],phase [deg]", rows, amplitude=True)


def _injections(designed: Device, device: Device, random: np.random.Generator) -> str:
    half, fills = designed.chambers // 2, {}
    now = 1.2e-5 * np.exp(1j * random.uniform(0, 6))
    noise, rows = random.uniform(1e-8, 6e-8), []
    before = _read(now, noise, random)
    for i in range(4 * half):
        chamber = i % half + half * (i // half % 2)
        pair, sign = chamber % half, 1 if chamber < half else -1
        x = fills.get(pair, 0.0)
        gauge = round(designed.pressure * random.uniform(0.95, 1.25), -3)
        time = _gas_time(designed, random)
        moved = injected(device, device.fill + sign * x, gauge, time)
        fills[pair] = x - sign * moved
        change = _pair(device, fills[pair]) - _pair(device, x)
        now = now + _response(device) * change * np.exp(2j * math.pi * pair / designed.chambers)
        after = _read(now, noise, random)
        rows.append(f"{LETTERS[chamber]},{1e3 * time:.1f},{1e-6 * gauge:.4f},{before},{after}")
        before = after
    head = "chamber,gas_time [ms],pressure [MPa],amplitude_before [um],phase_before [deg],"
    return _text("injection", head + "amplitude_after [um],phase_after [deg]", rows, amplitude=True)


def _pair(device: Device, moved: float) -> float:
    return device.moment(device.fill + moved) - device.moment(device.fill - moved)


def _gas_time(designed: Device, random: np.random.Generator) -> float:
    """That moves some 2 to 9 % of a chamber."""
    u = 10.0
    for _ in range(30):
        u = (u + math.sqrt(2 * designed.pressure / designed.density / designed.loss(u))) / 2
    return round(random.uniform(0.02, 0.09) * designed.volume / designed.area / u, 4)


def _transfers(designed: Device, device: Device, random: np.random.Generator) -> str:
    rows, noise = [], random.uniform(0.005, 0.02)
    for _ in range(8):
        fill, gauge = round(random.uniform(0.2, 0.42), 3), round(designed.pressure * random.uniform(1, 1.2), -3)
        time = _gas_time(designed, random)
        mass = device.density * device.volume * injected(device, fill, gauge, time)
        seen = 1e3 * mass * (1 + noise * random.standard_normal())
        rows.append(f"{fill},{1e-6 * gauge:.4f},{1e3 * time:.1f},{seen:.2f}")
    return _text("transfer", "fill_ratio,pressure [MPa],gas_time [ms],mass [g]", rows)


def _flows(_: Device, device: Device, random: np.random.Generator) -> str:
    """Between two reservoirs at rest."""
    still, rows, noise = replace(device, speed=0.0), [], random.uniform(0.005, 0.02)
    for pressure in np.geomspace(3e4, 6e5, 8):
        u = 1.0
        for _ in range(60):
            u = (u + math.sqrt(2 * pressure / device.density / still.loss(u))) / 2
        seen = 1e6 * u * device.area * (1 + noise * random.standard_normal())
        rows.append(f"{1e-3 * pressure:.2f},{seen:.2f}")
    return _text("flow", "pressure_difference [kPa],flow_rate [ml/s]", rows)


_RECORDS: Final = {
    "trial_weight": _trial_weights,
    "injection": _injections,
    "transfer": _transfers,
    "flow": _flows,
}
