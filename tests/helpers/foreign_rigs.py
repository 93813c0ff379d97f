"""Test rigs of which every number comes from `foreign_device`, none from the program.

A rig is a scene file as its designer writes it, the device that was built, every stated input drawn from what
the scene states of it, and files of what was read on it.  Readings are rounded as instruments show them, and
the gauge of the gas is off by a constant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from foreign_device import Device, injected

TWO_SIGMA: Final = 1.959964
LETTERS: Final = "ABCDEFGH"


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
VISCOUS: Final = replace(
    MACHINES["water, six chambers"],
    density=930.0,
    kinematic_viscosity=5.0e-5,
    bore=3.5e-3,
)
"""Whose tube holds 2 ml, of the 2 to 11 ml that an injection moves."""
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


def rig_of_known_geometry(number: int) -> Rig:
    """One rig whose scene states nothing of lambda: each second one an oil over six chambers, and each second
    of these does not coast."""
    random = np.random.default_rng([1174, number])
    names = list(MACHINES)
    machine = "oil, six chambers" if number % 2 else names[number // 2 % len(names)]
    designed = VISCOUS if number % 2 else MACHINES[machine]
    device = replace(_built(designed, random), coasts=number % 4 < 3)
    kinds = KINDS[number // 4 % 2 * 2]
    files = {f"{kind}.csv": _RECORDS[kind](designed, device, random) for kind in kinds}
    scene = _scene_text(machine, designed).replace("lambda_factor = 0.05\n", "")
    return Rig(machine=machine, scene=scene, files=files, device=device)


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
    return _text(
        "trial_weight", "unbalance [g*mm],angle [deg],amplitude [um],phase [deg]", rows, amplitude=True
    )


def _injections(designed: Device, device: Device, random: np.random.Generator) -> str:
    half = designed.chambers // 2
    fills: dict[int, float] = {}
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
    settings, masses = [], []
    for _ in range(8):
        fill = round(random.uniform(0.2, 0.42), 3)
        gauge = round(designed.pressure * random.uniform(1, 1.2), -3)
        time = _gas_time(designed, random)
        settings.append(f"{fill},{1e-6 * gauge:.4f},{1e3 * time:.1f}")
        masses.append(1e3 * device.density * device.volume * injected(device, fill, gauge, time))
    head = "fill_ratio,pressure [MPa],gas_time [ms],mass [g]"
    return _text("transfer", head, _shown(settings, masses, random))


def _flows(_: Device, device: Device, random: np.random.Generator) -> str:
    """Between two reservoirs at rest."""
    still = replace(device, speed=0.0)
    settings, rates = [], []
    for pressure in np.geomspace(3e4, 6e5, 8).tolist():
        u = 1.0
        for _round in range(60):
            u = (u + math.sqrt(2 * pressure / device.density / still.loss(u))) / 2
        settings.append(f"{1e-3 * pressure:.2f}")
        rates.append(1e6 * u * device.area)
    return _text("flow", "pressure_difference [kPa],flow_rate [ml/s]", _shown(settings, rates, random))


def _shown(settings: Sequence[str], values: Sequence[float], random: np.random.Generator) -> list[str]:
    """Rows with what an instrument shows, whose noise is the same over its range."""
    noise = random.uniform(0.005, 0.02) * math.sqrt(np.mean(np.square(values)))
    seen = np.asarray(values) + noise * random.standard_normal(len(values))
    return [f"{row},{value:.2f}" for row, value in zip(settings, seen.tolist(), strict=True)]


_RECORDS: Final = {
    "trial_weight": _trial_weights,
    "injection": _injections,
    "transfer": _transfers,
    "flow": _flows,
}


def covered(number: int, fitted: Mapping[str, tuple[float, float]]) -> dict[str, bool]:
    """Whether the interval of each fitted parameter holds what the device of a rig has."""
    device = rig(number).device
    return {name: low <= getattr(device, name) <= high for name, (low, high) in fitted.items()}
