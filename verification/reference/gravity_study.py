"""The free surface under gravity, found by finite elements, against the exact one over several levels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.pressure.assembly import at_cells, volume_points
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid, places
from ringbalance.physics.pressure.surface import solve_with_gravity
from ringbalance.scene.models import Disc, Shaft
from ringbalance.verification.evidence import Axis, Convergence, Curve, Evidence, Found, Series
from ringbalance.verification.orders import OrderStudy, order_study
from ringbalance.verification.reference.gravity_exact import ExactRing, exact_ring
from ringbalance.verification.reference.mutated_pressure import mutated_pressure

_TILT: Final = 0.1
"""Largest g/(omega^2 R1): a surface so tilted that a concentric one would be visibly wrong."""
_ROOM: Final = 0.3
"""Share of the room between surface and walls that the tilt may take."""
_DIRECTION: Final = 0.6
"""Of gravity from the chamber's centre line, rad: no axis of symmetry."""
_GRAVITY: Final = 9.80665
_GRAVITY_FLIPPED: Final = "gravity_sign_flipped"
_FACTORS: Final[Mapping[str | None, Mapping[str, float]]] = MappingProxyType(
    {"source_off_by_a_percent": {"source": 1.01}, "wall_condition_off_by_a_percent": {"wall": 1.01}}
)
"""Mutations of the pressure problem."""


@dataclass(frozen=True, kw_only=True)
class GravityStudy:
    """Errors over levels, coarse to fine."""

    surface: OrderStudy
    """Largest distance of a surface node from the exact surface, over the liquid's depth."""
    field: OrderStudy
    """Root mean square error of the pressure over the liquid, relative."""
    volume_error: float
    """Largest over levels, relative."""
    tilt: float
    """g/(omega^2 a)."""
    cells: tuple[tuple[int, ...], ...]


def gravity_study(
    *,
    disc: Disc,
    density: float,
    fill_ratio: float,
    cells: Sequence[tuple[int, ...]],
    shaft: Shaft,
    defect: str | None = None,
) -> GravityStudy:
    """Find the free surface on a sequence of meshes and hold it against the exact one.

    Args: `density`: rho, kg/m^3. `fill_ratio`: x. `cells`: of each level, coarse to fine, halving h each
        time. `shaft`: "horizontal" for gravity across the chamber, "vertical" for gravity along the shaft.
        `defect`: "gravity_sign_flipped", "source_off_by_a_percent" or "wall_condition_off_by_a_percent".
    Raises: ValueError: a search or solve that failed on some level.
    """
    true = tilted_liquid(disc=disc, density=density, fill_ratio=fill_ratio, shaft=shaft)
    exact = exact_ring(
        disc=disc,
        density=density,
        angular_velocity=true.angular_velocity,
        fill_ratio=fill_ratio,
        across=(true.gravity[0], true.gravity[1]),
        along=-sum(true.gravity[2:]),
    )
    liquid = replace(true, gravity=tuple(-g for g in true.gravity)) if defect == _GRAVITY_FLIPPED else true
    with mutated_pressure(**_FACTORS.get(defect, {})):
        solutions = [
            solve_with_gravity(disc=disc, liquid=liquid, fill_ratio=fill_ratio, cells=c) for c in cells
        ]
    failed = [solution.status for solution in solutions if not solution.status.ok]
    if failed:
        raise ValueError(failed[0].text)
    size = [cells[0][0] / count[0] for count in cells]
    return GravityStudy(
        surface=order_study(size=size, error=[_surface_error(disc, s, exact) for s in solutions]),
        field=order_study(size=size, error=[_field_error(s, exact) for s in solutions]),
        volume_error=max(abs(s.statistics.extra["volume_error"]) for s in solutions),
        tilt=_GRAVITY / (true.angular_velocity**2 * float(surface_radius(disc=disc, fill_ratio=fill_ratio))),
        cells=tuple(cells),
    )


def tilted_liquid(*, disc: Disc, density: float, fill_ratio: float, shaft: Shaft) -> RotatingLiquid:
    """Liquid that turns so slowly that gravity tilts its surface far, yet leaves the ring closed.

    Args: `density`: rho, kg/m^3. `fill_ratio`: x. `shaft`: "horizontal" for gravity across the chamber, at no
        angle of symmetry; "vertical" for gravity along the shaft.
    Returns: RotatingLiquid with two components of gravity across the shaft, three along it.
    """
    middle = float(surface_radius(disc=disc, fill_ratio=fill_ratio))
    speed = float(np.sqrt(_GRAVITY / _offset(disc, middle, shaft)))
    gravity = (0.0, 0.0, -_GRAVITY) if shaft == "vertical" else _across()
    return RotatingLiquid(density=density, angular_velocity=speed, gravity=gravity)


def _offset(disc: Disc, middle: float, shaft: Shaft) -> float:
    """g/omega^2, so large that the surface is far from concentric and still closed."""
    inner, outer = disc.inner_radius, disc.outer_radius
    if shaft == "horizontal":
        return min(_TILT * inner, _ROOM * min(middle - inner, outer - middle))
    return _ROOM * min(middle**2 - inner**2, outer**2 - middle**2) / disc.axial_width


def _across() -> tuple[float, float]:
    return _GRAVITY * float(np.cos(_DIRECTION)), _GRAVITY * float(np.sin(_DIRECTION))


def _surface_error(disc: Disc, solution: PressureSolution, exact: ExactRing) -> float:
    nodes = places(solution.chamber)[:, solution.chamber.grid[0]]
    angle = np.arctan2(nodes[1], nodes[0])
    axial = nodes[2] if len(nodes) == 3 else np.zeros_like(angle)
    away = np.hypot(nodes[0], nodes[1]) - exact.radius(angle, axial)
    depth = disc.outer_radius - float(np.mean(solution.chamber.surface_radius))
    return float(np.max(np.abs(away))) / depth


def _field_error(solution: PressureSolution, exact: ExactRing) -> float:
    volume = volume_points(solution.chamber.mesh)
    true = exact.pressure(solution.chamber.length_scale * volume.points)
    difference = at_cells(volume, solution.pressure) - true
    squares = [np.sum(volume.weights * field**2) for field in (difference, true)]
    return float(np.sqrt(squares[0] / squares[1]))


def gravity_evidence(study: GravityStudy) -> Evidence:
    """Evidence of a gravity study. Returns: Evidence with the quantities of the gravity cases."""
    note = "cells " + ", ".join(" x ".join(map(str, count)) for count in study.cells)
    tables = tuple(
        Convergence(
            quantity=quantity,
            unit="1",
            formal_order=formal,
            size=orders.size,
            error=orders.error,
            observed_order=orders.order,
            geometry="quadratic",
            note=note,
        )
        for quantity, orders, formal in (
            ("place of the free surface, over the depth", study.surface, 3.0),
            ("pressure field, relative error", study.field, 3.0),
        )
    )
    return Evidence(
        found={
            "surface_order": Found(value=study.surface.settled_order),
            "surface_error": Found(value=study.surface.finest_error),
            "field_order": Found(value=study.field.settled_order),
            "field_error": Found(value=study.field.finest_error),
            "volume_error": Found(value=study.volume_error),
        },
        numbers={"tilt": study.tilt, "direction": _DIRECTION},
        series=(
            Series(
                name="error against mesh size",
                x=Axis(name="relative mesh size", unit="1", values=np.array(study.surface.size)),
                y=(
                    Curve(name="free surface", unit="1", values=np.array(study.surface.error)),
                    Curve(name="pressure field", unit="1", values=np.array(study.field.error)),
                ),
                log=True,
            ),
        ),
        convergence=tables,
    )
