"""Devices that a scene may be, drawn by plain random numbers, for the plant of `own_plant`.

Nothing of the product but the scene's values is used. Friction and bends are correlations of textbooks, the
sector's area and moment are integrated here, and the widths that a scene leaves open are set here.  What
models may be off by has the causes and distributions that the documentation declares: those of the loss are
random functions of Re, each of its own term.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from ringbalance.scene.models import Scene

Floats = npt.NDArray[np.float64]

FILLS: Final = 513
SPEEDS: Final = np.linspace(0.0, 1.0, 513) ** 2 * 80.0
"""m/s, of the table of losses; even in the root."""
GAS_CONSTANT: Final = 287.05
_WAVES, _MODEL_MOMENT, _DEPTH, _ROUGHNESS, _AMPLITUDE = 0.002, 0.005, 0.3, 0.5, 0.05
_INFLUENCE, _LAG = 0.05, math.radians(3.0)
"""Expanded (95 %), relative but for the lag: of a chamber's pressure and of its moment by waves, of the depth
over a port, of a wall's roughness, of the first amplitude, of the rotor."""
_CAUSES: Final = ("friction", "rotation", "entry", "ends", "bends")
"""Of the errors of the loss."""
_CLEARING: Final = 0.25 / 0.85
"""Expanded (95 %), relative: Froude numbers 0.6 to 1.1 clear a crest of gas."""
_TABLES: Final = ("disc", "liquid", "tube", "gas", "rotor")


class Device(NamedTuple):
    """One machine in plain numbers, SI; pressures are gauge."""

    chambers: float
    total: float
    volume: float
    area: float
    length: float
    density: float
    half_square: float  # omega^2 / 2
    port: float  # r_p
    crest: float  # r_m; the port's radius without a crest
    crest_start: float  # share of the path
    crest_end: float
    entry: float  # loss and kinetic energy of a turbulent entrance, over u^2/2
    froude: float  # sqrt(omega^2 r_m d)
    cavity: float  # over the crest
    pressure: float
    ambient: float
    passing: float  # sonic conductance, 0 for an ideal valve
    critical: float
    dead_volume: float
    gas: float  # R T
    lag_of_valve: float
    residual: float  # fill
    gain_real: float
    gain_imaginary: float
    start_real: float
    start_imaginary: float
    leak: float  # sonic conductance from a chamber to the surroundings
    leak_in: float  # the same from the supply into a chamber whose valve is closed


class Drawn(NamedTuple):
    """A device with its tables."""

    device: Device
    square: Floats  # a^2 over the fill
    moment: Floats  # U over the fill
    loss: Floats  # ((k + 1) u^2/2)/u over SPEEDS
    upstream: Floats  # ((alpha + k_up) u^2/2)/u, to the end of the crest, from the first chamber
    downstream: Floats  # the same from the second


def widths(scene: Scene) -> dict[str, float]:
    """Absolute half-widths (95 %) by quantity: stated ones, and those that a scene leaves open."""
    found = {
        "density": scene.liquid.density_uncertainty * scene.liquid.density,
        "kinematic_viscosity": scene.liquid.viscosity_uncertainty * scene.liquid.kinematic_viscosity,
        "roughness": _ROUGHNESS * scene.tube.roughness,
        "influence_coefficient": _INFLUENCE * scene.rotor.influence_coefficient,
        "lag_angle": _LAG,
        "draw_down_factor": _DEPTH * scene.tube.draw_down_factor,
    }
    for stated in scene.uncertainty:
        found[stated.quantity] = stated.absolute(_values(scene)[stated.quantity])
    return found


def _values(scene: Scene) -> dict[str, Any]:
    return {name: value for table in _TABLES for name, value in vars(getattr(scene, table)).items()}


def drawn(scene: Scene, *, number: int, seed: int, phase: float | None = None) -> Drawn:
    """A device by its number; all inputs normal, direction, cavity and the crest's place uniform.

    Number -1 is the scene's own.
    Args: `phase`: of the vibration before balancing, rad; None: drawn.
    """
    random = np.random.default_rng([seed, number + 1])
    nominal = number < 0
    v, wide = _values(scene), widths(scene)
    for name, width in wide.items():
        z = 0.0 if nominal else float(random.standard_normal()) / 1.96
        low = 0.0 if name == "lag_angle" else 0.1 * v[name]
        v[name] = max(v[name] + z * width, low) if v[name] is not None else None
    extra = np.zeros(3) if nominal else random.standard_normal(3) / 1.96
    cavity, angle = (0.5, 0.0) if nominal else random.uniform(size=2)
    parts = np.zeros((len(_CAUSES), 2)) if nominal else random.standard_normal((len(_CAUSES), 2)) / 1.96
    v["loss_errors"] = dict(zip(_CAUSES, parts.tolist(), strict=True))
    v["model_moment"], v["waves"] = 1 + _MODEL_MOMENT * extra[1], _WAVES * extra[0]
    v["clearing"] = 1.0 if nominal else 1 + _CLEARING * float(random.standard_normal()) / 1.96
    v["slack_before"] = None if nominal else float(random.uniform())
    amplitude = scene.rotor.initial_amplitude * (1 + _AMPLITUDE * extra[2])
    phase = 2 * math.pi * float(angle) if phase is None else phase
    return _device(v, start=amplitude * np.exp(1j * phase), released=float(cavity))


def _device(v: dict[str, Any], *, start: complex, released: float) -> Drawn:
    square, moment, volume = _sector(v)
    omega, crest = v["speed"], v["hump_radius"] or v["port_radius"]
    begin, end, length = _path(v, crest)
    loss, upstream, downstream = _losses(v, omega, end, 1 - begin, length)
    vapour = v["vapour_pressure"] - v["ambient_pressure"]
    gain = v["influence_coefficient"] * np.exp(-1j * v["lag_angle"])
    device = Device(
        chambers=v["chambers"],
        total=2 * v["initial_fill"],
        volume=volume,
        area=math.pi / 4 * v["bore"] ** 2,
        length=length,
        density=v["density"],
        half_square=omega**2 / 2,
        port=v["port_radius"],
        crest=crest,
        crest_start=begin,
        crest_end=end,
        entry=1.56,
        froude=v["clearing"] * omega * math.sqrt(crest * v["bore"]),
        cavity=vapour * (1 - released) if v["dissolved_gas"] == "saturated" else vapour,
        pressure=v["pressure"],
        ambient=v["ambient_pressure"],
        passing=v["conductance"] or 0.0,
        critical=v["critical_ratio"] or 0.0,
        dead_volume=v["dead_volume"] or 0.0,
        gas=GAS_CONSTANT * 293.15,
        lag_of_valve=v["valve_lag"] or 0.0,
        residual=0.0,
        gain_real=gain.real,
        gain_imaginary=gain.imag,
        start_real=start.real,
        start_imaginary=start.imag,
        leak=v["leak_to_ambient"] or 0.0,
        leak_in=v["leak_from_supply"] or 0.0,
    )
    whole = Drawn(device, square, v["model_moment"] * moment, loss, upstream, downstream)
    residual = _residual(whole, v)
    return whole._replace(device=device._replace(residual=residual))


def _sector(v: dict[str, Any]) -> tuple[Floats, Floats, float]:
    """a^2 and U over even fills from 0 to the pair's, and V: trapezoids from the wall inwards."""
    r = np.linspace(v["outer_radius"], v["inner_radius"], 6001)
    half = v["central_angle"] / 2 - np.arcsin(v["plate_thickness"] / r)
    step = r[0] - r[1]

    def inwards(f: Floats) -> Floats:
        return np.concatenate([[0.0], np.cumsum((f[1:] + f[:-1]) / 2) * step])

    volume = v["axial_width"] * inwards(2 * half * r)
    moment = v["density"] * v["axial_width"] * inwards(2 * r**2 * np.sin(half))
    fills = np.linspace(0.0, 2 * v["initial_fill"], FILLS)
    x = volume / volume[-1]
    # Waves change the pressure of the liquid, whose surface they leave where it is.
    square = r[0] ** 2 - (r[0] ** 2 - r**2) * (1 + v["waves"])
    return np.interp(fills, x, square), np.interp(fills, x, moment), float(volume[-1])


def _path(v: dict[str, Any], crest: float) -> tuple[float, float, float]:
    """Shares of the path at which the arc of the crest begins and ends, and the length; a taut string.

    What the tube is longer than that lies before an arc or behind.
    """
    port = v["port_radius"]
    touch = math.acos(min(crest / port, 1.0))
    arc = crest * (math.pi - 2 * touch)
    shortest = arc + 2 * math.sqrt(max(port**2 - crest**2, 0.0))
    length = max(v["length"], shortest)
    share = arc / shortest if v["hump_shape"] == "arc" else 0.0
    legs = min(max(v["hump_position"], 0.0), 1.0) * (1 - share)
    if v["slack_before"] is None or share == 0.0:
        return legs, legs + share, length
    taut = shortest / length
    begin = legs * taut + v["slack_before"] * (1 - taut)
    return begin, begin + share * taut, length


def _losses(
    v: dict[str, Any], omega: float, near: float, far: float, length: float
) -> tuple[Floats, Floats, Floats]:
    """Heads over the velocity, m/s: between the chambers, and from either to the crest's far end.

    Friction: laminar and turbulent (Haaland) with rotation by Ito and Nanbu and the limit of fast rotation;
    the larger counts. Bends: White, Fluid Mechanics (Ito 1960). Sharp entrance 0.5, laminar ends 2.3.
    """
    d, nu = v["bore"], v["kinematic_viscosity"]
    u = np.maximum(SPEEDS, 1e-3)
    re, spin = u * d / nu, omega * d * d / nu
    kl, kt = re * spin, spin**2 / re
    slow = np.maximum(0.0883 * kl**0.25 * (1 + 11.2 * kl**-0.325), 0.07863 * math.sqrt(spin))
    laminar = 64 / re * np.maximum(slow, 1.0)
    haaland = (-1.8 * np.log10((v["roughness"] / d / 3.7) ** 1.11 + 6.9 / re)) ** -2
    fast = np.where(kt > 500, 0.942 * kt**0.05, 0.942 + 0.058 * np.maximum(kt, 1.0) ** 0.282)
    turbulent = haaland * np.where(kt > 1, np.maximum(fast, 1.0), 1.0)
    share = 1 / (1 + np.exp(np.clip((laminar - turbulent) / (0.05 * turbulent), -50, 50)))
    straight = (length - sum(b.angle * b.radius for b in v["bends"])) / d
    friction = np.maximum(laminar, turbulent) * straight
    plain = np.where(laminar > turbulent, 64 / re, haaland) * straight
    rotation, bends = friction - plain, 0 * u
    for b in v["bends"]:
        ratio = b.radius / d
        bends += 0.388 * (0.95 + 4.42 * ratio**-1.96) * ratio**0.84 * re**-0.17 * b.angle / (math.pi / 2)
    entrance = share * 0.5
    kinetic = share * 1.06 + (1 - share) * (1.2 + 0.8 * np.maximum(slow, 1.0) ** -1.5)
    outlet = share * (entrance + 1.0) + (1 - share) * 2.3 - entrance
    # Expanded (95 %): spread of the correlations, all that rotation adds to turbulent friction, what an inlet
    # may add before rotating laminar flow has developed, and edges and bends of handbooks.
    way = (0.2 + re / (57 * np.maximum(slow, 1.0)) + math.sqrt(spin) / 47) * d / length
    known = {
        "friction": (0.01 + 0.035 * share) * plain,
        "rotation": (0.02 + 0.98 * share) * rotation,
        "entry": (1 - share) * rotation * way * -np.expm1(-1 / way),
        "ends": 0.3 * (1 - share) + 0.08 * share,
        "bends": (0.6 - 0.35 * share) * bends,
    }
    error = {
        cause: known[cause] * (even * np.cos(np.log(re)) + odd * np.sin(np.log(re)))
        for cause, (even, odd) in v["loss_errors"].items()
    }
    friction = friction + error["friction"] + error["rotation"] + error["entry"]
    entrance, bends, scale = entrance + error["ends"], bends + error["bends"], u / 2
    whole = (friction + bends + entrance + outlet + v["extra_loss"]) * scale
    up, down = ((kinetic + entrance + bends / 2 + friction * s) * scale for s in (near, far))
    return whole, up, down


def _residual(whole: Drawn, v: dict[str, Any]) -> float:
    """Largest fill at which gas is drawn into the port of the chamber that a running tube empties."""
    d, fills = whole.device, np.linspace(0.0, whole.device.total, FILLS)
    driven, rho = fills[: FILLS // 2 + 1], whole.device.density
    head = d.pressure / rho - d.half_square * (
        np.interp(driven, fills, whole.square) - np.interp(d.total - driven, fills, whole.square)
    )
    siphon = np.interp(np.maximum(head, 0.0), whole.loss * SPEEDS, SPEEDS)
    over = (d.pressure - d.cavity) / rho - d.half_square * (
        np.interp(driven, fills, whole.square) - d.crest**2
    )
    broken = np.interp(np.maximum(over, 0.0), whole.upstream * SPEEDS, SPEEDS)
    u = np.minimum(siphon, broken) if v["hump_radius"] else siphon
    flow, pull = u * d.area, 2 * d.half_square * d.port
    sink = 0.688 * (flow**2 / pull) ** 0.2
    rim = 1.5 * (flow / (math.pi * v["bore"] * math.sqrt(pull))) ** (2 / 3)
    least = np.minimum(sink, rim)
    wall = math.sqrt(v["axial_width"] * v["central_angle"] * v["outer_radius"] / math.pi)
    around = np.log(wall / np.maximum(least, v["bore"] / 2)) - 0.75
    least = (least**4 + 6 * v["kinematic_viscosity"] * flow * around / (math.pi * pull)) ** 0.25
    spare = d.port - np.sqrt(np.interp(driven, fills, whole.square)) - v["draw_down_factor"] * least
    wanting = np.flatnonzero(spare <= 0)
    if wanting.size == 0:
        return 0.0
    last = int(wanting[-1])
    if last + 1 == driven.size:
        return float(driven[last])
    between = spare[last] / (spare[last] - spare[last + 1])
    return float(driven[last] + between * (driven[last + 1] - driven[last]))
