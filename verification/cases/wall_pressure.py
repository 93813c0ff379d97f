"""Claims on the pressure at the outer wall and the fall of the velocity that it causes."""

from __future__ import annotations

import dataclasses
from functools import lru_cache, partial
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.reduced_model import paper
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import (
    CaseTable,
    Evidence,
    FigureCurve,
    Found,
    Level,
    as_found,
    figure,
)
from ringbalance.verification.finite_elements import found_of, mesh_table, ring_of
from ringbalance.verification.loops import flow_law_of
from ringbalance.verification.papers import (
    DENSITY_KG_M3,
    DEPARTURE_HIGH,
    DEPARTURE_LOW,
    HIGH_PRESSURE_PA,
    LOW_PRESSURE_PA,
    RING_RADIUS,
    at_paper_density,
    rounded_radius,
    with_plate,
)
from ringbalance.verification.reference.chambers import (
    exact_moment,
    wall_pressure_of,
    whole_ring_pressure,
)

_FILLS_OF_MAX: Final = np.array([0.1, 0.3, 0.5, 0.7, 0.9, 1.0])
_JUDGED: Final = {"thin": 0, "half": 2, "full": 5}
"""Judged fills by name, as indices of `_FILLS_OF_MAX`."""
_SPEED_RATIOS: Final = (0.1, 0.2, 0.5, 1.0)
"""Speeds of the table over the scene's."""
_PRESSURES: Final = {"low": LOW_PRESSURE_PA, "high": HIGH_PRESSURE_PA}
_PRINTED: Final = {"low": DEPARTURE_LOW, "high": DEPARTURE_HIGH}
_CURVE_POINTS: Final = 41


def wall_pressure_ends(scene: Scene) -> Evidence:
    """Eq. 12 against the closed form."""
    pressure = wall_pressure_of(scene, _FILLS_OF_MAX * scene.disc.max_fill_ratio)
    by_eq_12 = _eq_12(scene, scene.disc, _FILLS_OF_MAX * scene.disc.max_fill_ratio)
    return Evidence(
        quantities={
            name: Found(value=float(pressure[index])).against(by_eq_12[index])
            for name, index in _JUDGED.items()
        }
    )


def wall_pressure(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Eq. 12 against finite elements over fill, plate thickness, speed and gravity."""
    disc, bare = scene.disc, with_plate(scene.disc, 0.0)
    x = _FILLS_OF_MAX * disc.max_fill_ratio
    ring = ring_of(scene, tuple(x.tolist()))
    by_eq_12 = _eq_12(scene, disc, x)
    shortfall = 1 - by_eq_12 / ring.wall_pressure.value
    without_plates = _eq_12(scene, bare, x)
    # Eq. 12 gives for a volume the pressure of a ring without plates.
    same_volume = x * chamber_volume(disc=disc) / chamber_volume(disc=bare)
    corrected = wall_pressure_of(scene, same_volume, disc=bare)
    unplated = dataclasses.replace(scene, disc=bare)
    shape = found_of(ring_of(unplated, (bare.max_fill_ratio,)), "wall_pressure", 0)
    if defect == "whole_ring":
        shape = dataclasses.replace(shape, value=whole_ring_pressure(unplated))
    gravity = _gravity_table(scene)
    # Relative error of Eq. 12 against plate thickness, at the smallest and the largest fill.
    widest = 0.5 * disc.inner_radius * np.sin(disc.central_angle / 2)
    thickness = np.linspace(0, widest, 21)
    fills = np.array([0.02, 1.0]) * disc.max_fill_ratio
    discs = [with_plate(disc, t) for t in thickness]
    thin, full = np.transpose(
        [_eq_12(scene, each, fills) / wall_pressure_of(scene, fills, disc=each) - 1 for each in discs]
    )
    over_plates = figure(
        "error of Eq. 12 against the thickness of the plates",
        ("plate thickness", "m", thickness),
        FigureCurve("thin ring", "1", thin, style="paper"),
        FigureCurve("largest fill", "1", full, style="paper"),
    )
    over_fill = figure(
        "pressure on the outer wall",
        ("fill ratio", "1", x),
        FigureCurve(
            "finite elements", "Pa", ring.wall_pressure.value, uncertainty=ring.wall_pressure.uncertainty
        ),
        FigureCurve("Eq. 12", "Pa", by_eq_12, style="paper"),
    )
    return Evidence(
        quantities={
            name: dataclasses.replace(
                found_of(ring, "wall_pressure", index), corrected=float(corrected[index])
            ).against(by_eq_12[index])
            for name, index in _JUDGED.items()
        }
        | {"without_plates": shape.scaled(1 / float(without_plates[-1])).against(1.0)},
        numbers={
            "shortfall_full": shortfall[-1],
            "shortfall_thin": shortfall[0],
            "bare_difference": float(
                np.max(np.abs(without_plates / wall_pressure_of(scene, x, disc=bare) - 1))
            ),
            "gravity": gravity.columns["change by gravity"][-1],
        },
        series=(over_fill, over_plates),
        convergence=(mesh_table(ring, "wall_pressure", "Pa", -1),),
        tables=(gravity,),
        status=ring.status,
    )


def _eq_12(scene: Scene, disc: Disc, fill: FloatArray) -> FloatArray:
    return paper.wall_pressure_paper(
        disc=disc,
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        liquid_volume=fill * chamber_volume(disc=disc),
    )


def _gravity_table(scene: Scene) -> CaseTable:
    """Mean wall pressure over a turn with gravity, relative to that without, at falling speeds."""
    speeds = [share * scene.rotor.speed for share in _SPEED_RATIOS]
    middle = scene.disc.max_fill_ratio / 2
    density, gravity = scene.liquid.density, scene.environment.gravity
    rings = [
        _tilted(disc=scene.disc, density=density, speed=speed, fill=middle, gravity=gravity)
        for speed in speeds
    ]
    plain = float(wall_pressure_of(scene, middle)) * np.square(_SPEED_RATIOS)
    mean, closed = np.array([(ring.wall_pressure.value[0], ring.solved[0]) for ring in rings]).T
    ripple = np.array([ring.ripple["wall_pressure"][0] for ring in rings])
    return CaseTable(
        name="gravity across the shaft: change of the mean wall pressure, and its ripple over a turn",
        columns={
            "speed": speeds,
            "change by gravity": np.where(closed, mean / plain - 1, 0.0).tolist(),
            "ripple": (ripple / plain).tolist(),
            "ring": ["closed" if each else "no closed ring" for each in closed],
        },
        units={"speed": "rad/s", "change by gravity": "1", "ripple": "1"},
    )


@lru_cache(maxsize=4)
def _tilted(*, disc: Disc, density: float, speed: float, fill: float, gravity: float) -> RingQuantities:
    return ring_quantities(
        disc=disc,
        density=density,
        angular_velocity=speed,
        fill_ratio=fill,
        gravity=gravity,
        dimension=2,
    )


def velocity_departure_ends(scene: Scene) -> Evidence:
    """Velocity falls under the true wall pressure; Eq. 19's arithmetic leaves out the plates."""
    return Evidence(quantities=_departures(at_paper_density(scene)))


def velocity_departure(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Velocity fall under the true wall pressure, by Eq. 19's arithmetic, and by the calibrated law."""
    printed_scene = at_paper_density(scene)
    physics = _departures(printed_scene)
    if defect == "eq_12_used":
        physics = {name: number.with_correction() for name, number in physics.items()}
    arithmetic = {
        f"arithmetic_{name}": Found(
            value=_eq_19(printed_scene, p),
            input=rounded_radius(partial(_eq_19, printed_scene, p)),
            reference=_PRINTED[name],
        )
        for name, p in _PRESSURES.items()
    }
    share = np.linspace(0, 1, _CURVE_POINTS)
    fall = _relative_velocity(
        printed_scene, LOW_PRESSURE_PA, share[::-1] if defect == "chambers_exchanged" else share
    )
    stall = paper.stall_pressure(
        disc=printed_scene.disc, density=DENSITY_KG_M3, angular_velocity=printed_scene.rotor.speed
    )
    law = flow_law_of(printed_scene)
    law_falls, figures = {}, []
    for name, p in _PRESSURES.items():
        velocity = law.evaluate(fill_ratio=share * law.max_fill_ratio, gas_pressure=p, primed=True).velocity
        law_falls[f"law_{name}"] = 1 - float(velocity[0] / velocity[-1])
        eq_19 = np.sqrt((p + stall * (2 * share - 1)) / (p + stall))
        figures.append(
            figure(
                f"velocity over that of a full chamber, {p / 1e6:.1f} MPa",
                ("fill ratio", "1", share * scene.disc.max_fill_ratio),
                FigureCurve("Eq. 19", "1", eq_19, style="paper"),
                FigureCurve("true wall pressure, one k", "1", _relative_velocity(printed_scene, p, share)),
                FigureCurve("calibrated law of the scene", "1", velocity / velocity[-1], style="reference"),
            )
        )
    return Evidence(
        quantities={**physics, **arithmetic, **as_found(slope=np.min(np.diff(fall)) * (_CURVE_POINTS - 1))},
        numbers={
            **{
                f"rounded_{name}": _eq_19(printed_scene, p, RING_RADIUS.value)
                for name, p in _PRESSURES.items()
            },
            "shortfall": 1 - stall / _full_pressure(printed_scene),
            **law_falls,
        },
        series=tuple(figures),
    )


def _departures(scene: Scene) -> dict[str, Found]:
    """Falls with a full chamber's true wall pressure; corrected: with Eq. 12's at the printed radius."""
    full = _full_pressure(scene)
    return {
        f"departure_{name}": Found(
            value=1 - float(np.sqrt((p - full) / (p + full))),
            corrected=_eq_19(scene, p, RING_RADIUS.value),
            reference=_PRINTED[name],
        )
        for name, p in _PRESSURES.items()
    }


def _full_pressure(scene: Scene) -> float:
    return float(wall_pressure_of(scene, scene.disc.max_fill_ratio, density=DENSITY_KG_M3))


def _eq_19(scene: Scene, pressure: float, radius: float | None = None) -> float:
    """Fall of the velocity by Eq. 19, with the liquid volume that a radius of the ring implies by Eq. 3."""
    disc, area = scene.disc, paper.flat_strip_area
    volume = None if radius is None else disc.axial_width * float(area(disc=disc, surface_radius=radius))
    fall = paper.departure(
        disc=disc,
        density=DENSITY_KG_M3,
        angular_velocity=scene.rotor.speed,
        gas_pressure=pressure,
        pair_volume=volume,
    )
    return float(fall)


def _relative_velocity(scene: Scene, pressure: float, share: FloatArray) -> FloatArray:
    """u(x)/u(x_max) with the true wall pressure and one k."""
    fills = np.array([share, 1 - share]) * scene.disc.max_fill_ratio
    driven, other = wall_pressure_of(scene, fills, density=DENSITY_KG_M3)
    squared = pressure + driven - other
    return np.asarray(np.sqrt(squared / squared[-1]), dtype=np.float64)


def rectangular_element(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The integral of Eq. 11 against finite elements, and against the force balance of the whole liquid."""
    fills = np.array([0.2, 0.4, 0.6, 0.8, 1.0]) * scene.disc.max_fill_ratio
    ring, exact = ring_of(scene, tuple(fills.tolist())), wall_pressure_of(scene, fills)
    pressure, whole_ring = found_of(ring, "wall_pressure", -1), whole_ring_pressure(scene)
    if defect == "whole_ring":
        pressure = dataclasses.replace(pressure, value=whole_ring)
    moment = exact_moment(disc=scene.disc, density=scene.liquid.density, fill_ratio=scene.disc.max_fill_ratio)
    # Net force of the liquid on all walls along the centre line.
    force = Found.within(ring.resultant_force.value[-1], ring.resultant_force.uncertainty[-1])
    shown = figure(
        "pressure on the outer wall",
        ("fill ratio", "1", fills),
        FigureCurve("finite elements", "Pa", ring.wall_pressure.value),
        FigureCurve("Eq. 11 integrated", "Pa", exact, style="paper"),
    )
    return Evidence(
        quantities={
            "wall_pressure": pressure.against(exact[-1]),
            "force_balance": force.scaled(1 / (scene.rotor.speed**2 * float(moment))).against(1.0),
        },
        numbers={"whole_ring": 1 - whole_ring / float(exact[-1])},
        series=(shown,),
        convergence=(mesh_table(ring, "wall_pressure", "Pa", -1),),
        status=ring.status,
    )
