"""The liquid-ring paper, Eqs. 9 to 19: ring pressure, tube velocity, stall and departure, as printed."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.pressure.hydrostatics import hydrostatic_pressure
from ringbalance.reduced_model.paper.chamber import chamber_volume_paper, max_liquid_volume_paper
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc

PAPER_DRAG_COEFFICIENT: Final = 50.0
"""k between the ends of the connecting tube, "about 50" (section 3.2)."""


def ring_pressure(
    *, disc: Disc, density: float, angular_velocity: float, surface_radius: npt.ArrayLike
) -> FloatArray:
    """Liquid pressure on the outer wall, integral of dp = rho omega^2 r dr = rho omega^2 (R2^2 - R1'^2)/2.

    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `surface_radius`: R1', m, any shape.
    Returns: Pressure above the gas pressure, Pa, the shape of `surface_radius`.
    Source: Eqs. 9 to 11 integrated; exact without gravity.
    """
    a = np.asarray(surface_radius, dtype=np.float64)
    return hydrostatic_pressure(
        density=density, angular_velocity=angular_velocity, inner=a, outer=disc.outer_radius
    )


def wall_pressure_paper(
    *, disc: Disc, density: float, angular_velocity: float, liquid_volume: npt.ArrayLike
) -> FloatArray:
    """Liquid pressure on the outer wall from the volume, p = rho omega^2 V'/(B theta).

    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `liquid_volume`: V', m^3, any shape.
    Returns: Pressure above the gas pressure, Pa, the shape of `liquid_volume`.
    Source: Eq. 12; equals Eqs. 9 to 11 only where V' = B theta (R2^2 - R1'^2)/2, that is without plates.
    """
    volume = np.asarray(liquid_volume, dtype=np.float64)
    return np.asarray(_pressure_per_volume(disc, density, angular_velocity) * volume, dtype=np.float64)


def _pressure_per_volume(disc: Disc, density: float, angular_velocity: float) -> float:
    return density * angular_velocity**2 / (disc.axial_width * disc.central_angle)


def velocity_from_pressures(
    *, density: float, drag_coefficient: npt.ArrayLike, pressure_difference: npt.ArrayLike
) -> FloatArray:
    """Tube velocity from the pressures at its ends, (p1 - p3)/rho = (k + 1) u^2/2.

    Args: `density`: rho, kg/m^3. `drag_coefficient`: k, any shape. `pressure_difference`: p1 - p3, Pa, any
        shape that broadcasts.
    Returns: u, m/s, of the broadcast shape; zero where the difference is not positive.
    Source: Eqs. 13 and 14 (both ends at one radius, gravity left out).
    """
    k = np.asarray(drag_coefficient, dtype=np.float64)
    difference = np.maximum(np.asarray(pressure_difference, dtype=np.float64), 0.0)
    return np.asarray(np.sqrt(2 * difference / (density * (k + 1))), dtype=np.float64)


def velocity_from_volumes(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    drag_coefficient: float,
    gas_pressure: npt.ArrayLike,
    liquid_volume: npt.ArrayLike,
    pair_volume: npt.ArrayLike,
) -> FloatArray:
    """Tube velocity from the liquid volumes, (k + 1) u^2/2 = p0/rho + omega^2 (2 V'_A - V'_AC)/(B theta).

    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `gas_pressure`: p0, gauge, Pa, any shape.
        `liquid_volume`: V'_A of the driven chamber, m^3, any shape that broadcasts. `pair_volume`: V'_AC of
        both chambers, m^3, any shape that broadcasts.
    Returns: u, m/s, of the broadcast shape; zero where the driving pressure is not positive.
    Source: Eqs. 15 to 18.
    """
    v_a, v_ac = (np.asarray(v, dtype=np.float64) for v in (liquid_volume, pair_volume))
    level = _pressure_per_volume(disc, density, angular_velocity) * (2 * v_a - v_ac)
    return velocity_from_pressures(
        density=density,
        drag_coefficient=drag_coefficient,
        pressure_difference=np.asarray(gas_pressure, dtype=np.float64) + level,
    )


def velocity_paper(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    drag_coefficient: float,
    gas_pressure: npt.ArrayLike,
    fill_ratio: npt.ArrayLike,
) -> FloatArray:
    """Tube velocity from the fill ratio.

    u = sqrt(2/(rho (k+1)) [p0 + rho omega^2 V (2 x_a - 0.5)/(B theta)])
    Args: `disc`: the disc; its `max_fill_ratio` stands for the paper's 0.5. `density`: rho, kg/m^3.
        `angular_velocity`: omega, rad/s. `drag_coefficient`: k. `gas_pressure`: p0, gauge, Pa, any shape.
        `fill_ratio`: x_a of the driven chamber, any shape that broadcasts.
    Returns: u, m/s, of the broadcast shape; zero where the bracket is not positive.
    Source: Eq. 19.
    """
    volume = chamber_volume_paper(disc=disc)
    return velocity_from_volumes(
        disc=disc,
        density=density,
        angular_velocity=angular_velocity,
        drag_coefficient=drag_coefficient,
        gas_pressure=gas_pressure,
        liquid_volume=np.asarray(fill_ratio, dtype=np.float64) * volume,
        pair_volume=disc.max_fill_ratio * volume,
    )


def stall_pressure(
    *, disc: Disc, density: float, angular_velocity: float, fill_ratio: npt.ArrayLike = 0.0
) -> FloatArray:
    """Gas pressure at which Eq. 19's velocity vanishes, p0 = rho omega^2 V (x_max - 2 x_a)/(B theta).

    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `fill_ratio`: x_a, any shape; zero gives
        the pressure that empties the chamber.
    Returns: Gauge pressure, Pa, the shape of `fill_ratio`; 0.381 MPa for the paper's disc, which the paper
        does not print: it quotes 0.54 to 1.77 MPa as the working range.
    Source: Eq. 19 with u = 0.
    """
    x = np.asarray(fill_ratio, dtype=np.float64)
    return wall_pressure_paper(
        disc=disc,
        density=density,
        angular_velocity=angular_velocity,
        liquid_volume=chamber_volume_paper(disc=disc) * (disc.max_fill_ratio - 2 * x),
    )


def departure(
    *,
    disc: Disc,
    density: float,
    angular_velocity: float,
    gas_pressure: npt.ArrayLike,
    pair_volume: float | None = None,
) -> FloatArray:
    """Total departure of the velocity while a full chamber empties, 1 - u(x_a = 0)/u(x_a = x_max).

    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `gas_pressure`: p0, gauge, Pa, any shape.
        `pair_volume`: V'_AC, m^3; default x_max V. Other values show what the paper's roundings do.
    Returns: Departure, the shape of `gas_pressure`; independent of k; one where the chamber stalls on the
        way.
    Source: Eq. 18 and the text under Fig. 4, which prints 45.6 % at 0.7 MPa and 22.9 % at 1.5 MPa. The
        unrounded volume gives 45.7 % and 22.9 %; the printed pair follows from R1'_min rounded to 34.9 mm.
    """
    total = max_liquid_volume_paper(disc=disc) if pair_volume is None else pair_volume
    at_full, at_empty = (
        velocity_from_volumes(
            disc=disc,
            density=density,
            angular_velocity=angular_velocity,
            drag_coefficient=PAPER_DRAG_COEFFICIENT,
            gas_pressure=gas_pressure,
            liquid_volume=v,
            pair_volume=total,
        )
        for v in (total, 0.0)
    )
    return np.asarray(1 - at_empty / at_full, dtype=np.float64)
