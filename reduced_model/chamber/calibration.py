"""Wall pressure and moment of a chamber over its fill, checked by finite elements, with its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, head_square, surface_radius
from ringbalance.physics.results import Estimate, Statistics, Status
from ringbalance.reduced_model.chamber.contributions import (
    chamber_status,
    gravity_shares,
    unmodelled_fractions,
)
from ringbalance.reduced_model.chamber.element_check import ElementCheck
from ringbalance.reduced_model.chamber.values import RingValues, chamber_pressure, measured_closed_forms
from ringbalance.reduced_model.pieces.table import Table, smooth_table, smooth_tables, spline
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.designs import Designs, changes_of
from ringbalance.scene.errors import by_group, uncertainties
from ringbalance.scene.models import Disc, Scene

FILL_STEP: Final = 0.05
"""Step of the fill ratios that a calibration reports."""
ROUND_OFF: Final = 16 * float(np.finfo(np.float64).eps)
"""Lower bound of a numerical half-width, relative."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FillCurve:
    """One quantity over the fill ratio: values, their half-widths by cause, and a smooth table.

    Arrays run along `ChamberCalibration.fill_ratio`, whose first entries are the table's nodes.
    """

    value: FloatArray
    """Values by closed forms, or by quadrature where gravity is modelled."""
    numerical: FloatArray
    """Expanded uncertainty (95 %) by rounding, quadrature, and contradictions of finite elements."""
    unmodelled: FloatArray
    """Expanded uncertainty (95 %) by unmodelled effects: surface tension, friction at walls, high waves."""
    inputs: FloatArray
    """Expanded uncertainty (95 %) by the scene's uncertain inputs."""
    table: Table
    """Interpolant of the values, with slopes and curvatures."""
    interpolation: FloatArray
    """Expanded uncertainty (95 %) of the table near each node; a table may have more knots than nodes."""
    status: Status
    """Status over the whole range of fills."""

    @property
    def uncertainty(self) -> FloatArray:
        """Half-width of the value at the scene's nominal inputs: numerical and unmodelled terms."""
        return np.hypot(self.numerical, self.unmodelled)

    def half_widths(self, *, inputs: FloatArray) -> FloatArray:
        """Half-width at the table's knots: numerical, unmodelled terms, interpolation and some inputs.

        Args: `inputs`: expanded uncertainty (95 %) by those inputs, along the fill ratio.
        """
        count, knots = self.interpolation.size, self.table.knots
        squares = (self.uncertainty**2 + inputs**2)[:count] + self.interpolation**2
        return np.interp(knots, np.linspace(knots[0], knots[-1], count), np.sqrt(squares))


_INPUTS: Final = (
    "outer_radius",
    "inner_radius",
    "axial_width",
    "central_angle",
    "plate_thickness",
    "density",
    "speed",
    "lambda_factor",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class ChamberCalibration:
    """Totals of one chamber over its fill ratio, and lambda."""

    volume: float
    """V, m^3."""
    fill_ratio: FloatArray
    """Nodes, equally spaced from zero to max_fill_ratio, then the reported fill ratios that are no nodes."""
    ring: RingValues
    """Closed forms at `fill_ratio`."""
    elements: ElementCheck | None
    """Check by finite elements at a few fill ratios; None: left out."""
    reported_fill_ratio: FloatArray
    """0, 0.05, ... max_fill_ratio."""
    reported: tuple[int, ...]
    """Indices of `reported_fill_ratio` in `fill_ratio`."""
    wall_pressure: FillCurve
    """Mean liquid pressure on the outer wall, Pa: a load."""
    hydrostatic_pressure: FillCurve
    """Liquid pressure at the outer radius R2, rho omega^2 (R2^2 - a^2)/2, Pa: it drives the tube."""
    moment: FillCurve
    """U, kg m."""
    moment_per_mass: Estimate
    """lambda at equal fills, per transferred mass, m, shape (); half-width without the inputs."""
    moment_per_mass_numerical: float
    """Numerical part of the half-width of lambda, m."""
    status: Status
    """Status of the solves or, where these are sound, of the ring's waves over the range of fills."""
    statistics: Statistics

    @property
    def check(self) -> ElementCheck:
        """`elements`. Raises: ValueError: they were left out."""
        if self.elements is None:
            raise ValueError("this chamber was not checked by finite elements")
        return self.elements


def fill_nodes(*, largest: float) -> tuple[FloatArray, FloatArray]:
    """Fill ratios of the tables and of the report.

    Args: `largest`: max_fill_ratio.
    Returns: Nodes (an odd number, so that equal fills are one) and reported fill ratios (0, 0.05, ...
        largest).
    """
    steps = math.ceil(largest / FILL_STEP - 1e-9)
    # At least eleven nodes, so that even a small range has an error estimate from every second node.
    nodes = np.linspace(0.0, largest, 2 * max(5, steps) + 1)
    reported = np.append(np.round(FILL_STEP * np.arange(steps), 10), largest)
    return nodes, reported


def calibrate_chamber(scene: Scene, *, checked: bool = True, varied: bool = True) -> ChamberCalibration:
    """Evaluate the closed forms over the fill range and check them by finite elements at a few fills.

    The values include the mean effect of gravity over a turn; the finite elements include it only where it
    exceeds the scene's tolerance at some fill, because they then take ten times as long. A ring must exist.
    Args: `checked`: true if finite elements check the values, which takes most of the time. `varied`: true if
        the uncertain inputs are varied to both sides.
    Raises: SceneError: as `scene_ring`.
    Source: Eqs. 2 to 12 of the liquid-ring paper with exact plates; moments and lambda times the scene's
        measured factor.
    """
    nodes, reported = fill_nodes(largest=scene.disc.max_fill_ratio)
    fills = np.append(nodes, [x for x in reported if np.min(np.abs(nodes - x)) > 1e-12])
    ring = RingValues.of(scene, fill_ratio=fills, gravity=scene.environment.gravity > 0)
    check, inputs = None, _input_half_widths(scene, fills) if varied else {}
    if checked:
        held = gravity_shares(scene).mean > scene.tolerance
        compared = ring if held else RingValues.of(scene, fill_ratio=fills, gravity=False)
        check = ElementCheck.of(scene, values=compared, gravity=held)
    # Finite elements check the geometry, so the measured factor is applied after the check.
    factor, unmodelled = scene.disc.moment_factor, unmodelled_fractions(scene, fills)
    moment, slope = (
        replace(each, value=factor * each.value, uncertainty=factor * each.uncertainty)
        for each in (ring.moment, ring.moment_per_volume)
    )
    ring, waves = replace(ring, moment=moment, moment_per_volume=slope), chamber_status(scene)

    def checked_by(quantity: str) -> tuple[float, Status]:
        excess, contradicted = (
            (check.excess_of(quantity), check.status_of(quantity)) if check else (0.0, Status())
        )
        return excess, _first(ring.status, contradicted, waves)

    def curve(quantity: str, share: str) -> FillCurve:
        estimate: Estimate = getattr(ring, quantity)
        value, (excess, status) = estimate.value, checked_by(quantity)
        at_nodes, level = value[: nodes.size], quantity == "hydrostatic_pressure"
        table, missed = pressure_table(scene, nodes, at_nodes) if level else _even_table(nodes, at_nodes)
        return FillCurve(
            value=value,
            numerical=estimate.uncertainty + (ROUND_OFF + excess) * np.abs(value),
            unmodelled=unmodelled[share] * np.abs(value),
            inputs=inputs.get(quantity, np.zeros_like(value)),
            table=table,
            interpolation=missed,
            status=status,
        )

    excess, status = checked_by("moment_per_volume")
    ratio, numerical, missing = _lambda_at_equal_fills(
        scene, nodes, slope, excess, unmodelled["moments"], moment.value
    )
    return ChamberCalibration(
        volume=chamber_volume(disc=scene.disc),
        fill_ratio=fills,
        ring=ring,
        elements=check,
        reported_fill_ratio=reported,
        reported=tuple(int(np.argmin(np.abs(fills - x))) for x in reported),
        wall_pressure=curve("wall_pressure", "pressures"),
        hydrostatic_pressure=curve("hydrostatic_pressure", "heads"),
        moment=curve("moment", "moments"),
        moment_per_mass=Estimate(
            value=np.asarray(ratio), uncertainty=np.asarray(math.hypot(numerical, missing)), status=status
        ),
        moment_per_mass_numerical=numerical,
        status=_first(ring.status, check.status if check else Status(), waves),
        statistics=check.elements.statistics if check else Statistics(),
    )


def _input_half_widths(scene: Scene, fills: FloatArray) -> dict[str, FloatArray]:
    """Expanded uncertainties (95 %) by the uncertain inputs together, along the fills; by closed forms."""

    def values(designs: Designs) -> FloatArray:
        wall, moment, _ = measured_closed_forms(scene=designs.scene, fill_ratio=fills[:, None])
        level = chamber_pressure(scene=designs.scene, fill_ratio=fills[:, None])
        return np.array(np.broadcast_arrays(wall, level, moment))

    errors = uncertainties(scene, among=_INPUTS, models=False, fitted_models=False)
    effects = by_group(errors, changes_of(scene, values, errors)[1])
    squares = sum((each**2 for each in effects.values()), start=np.zeros((3, fills.size)))
    names = ("wall_pressure", "hydrostatic_pressure", "moment")
    return dict(zip(names, np.sqrt(squares), strict=True))


def _first(*statuses: Status) -> Status:
    """First status that is not OK."""
    return next((each for each in statuses if not each.ok), statuses[-1])


def _lambda_at_equal_fills(
    scene: Scene,
    nodes: FloatArray,
    slope: Estimate,
    excess: float,
    unmodelled: FloatArray,
    moment: FloatArray,
) -> tuple[float, float, float]:
    """lambda at equal fills, 2 (dU/dV')/rho, m, and its numerical and its unmodelled half-width, m.

    Unmodelled fractions of the moment count by their change with the fill.
    """
    m, density = nodes.size // 2, scene.liquid.density
    value = 2 * float(slope.value[m]) / density
    numerical = 2 * float(slope.uncertainty[m]) / density + (ROUND_OFF + excess) * value
    mass = density * chamber_volume(disc=scene.disc) * float(nodes[m + 1] - nodes[m - 1])
    share = unmodelled * moment
    missing = max(2 * abs(float(share[m + 1] - share[m - 1])) / mass, float(unmodelled[m]) * value)
    return value, numerical, missing


_PIECES: Final = 1000
"""Least number of pieces of an imported chamber's table."""
_WITHIN_PIECE: Final = np.arange(1, 8) / 8
"""Fractions of a piece at which the table is compared."""


def _even_table(nodes: FloatArray, value: FloatArray) -> tuple[Table, FloatArray]:
    """Table through equally spaced fills, and its expanded uncertainty (95 %) near each of them."""
    coarse = spline(nodes[::2], value[::2] - value[0])
    # Twice the step at least triples the error: half the error of the coarse table is on the safe side.
    missed = float(np.max(np.abs(coarse(nodes) - (value - value[0]))))
    return smooth_table(nodes, value), np.full(nodes.shape, missed / 2)


def pressure_table(scene: Scene, nodes: FloatArray, value: FloatArray) -> tuple[Table, FloatArray]:
    """Table of the pressure at R2, Pa, and its expanded uncertainty (95 %) near each node.

    That of an imported chamber has the closed form at more fills.

    Args: `nodes`: equally spaced from zero. `value`: with gravity, where that is modelled.
    """
    disc = scene.disc
    if disc.geometry is None:
        return _even_table(nodes, value)
    scale = scene.liquid.density * scene.rotor.speed**2 / 2
    squares, error = _samples(disc, nodes.size, float(nodes[-1]))
    every = (squares.size - 1) // (nodes.size - 1)
    change, missed = _even_table(nodes, value - scale * squares[::every])
    fine = np.linspace(0.0, float(nodes[-1]), squares.size)
    return smooth_table(fine, scale * squares + change.quintic(fine)), scale * error + missed


def pressure_tables(
    scenes: Sequence[Scene], nodes: FloatArray, values: Sequence[FloatArray]
) -> Sequence[Table]:
    """The tables of `pressure_table` for scenes that differ in numbers alone."""
    if scenes[0].disc.geometry is not None:
        pairs = zip(scenes, values, strict=True)
        return [pressure_table(scene, nodes, value)[0] for scene, value in pairs]
    return smooth_tables(nodes, np.stack(values, axis=1))


@lru_cache(maxsize=16)
def _samples(disc: Disc, count: int, largest: float) -> tuple[FloatArray, FloatArray]:
    """R2^2 - a^2, m^2, at equally spaced fills, and the error of its table near each of `count` nodes."""
    every = -(-_PIECES // (count - 1))
    fills = np.linspace(0.0, largest, every * (count - 1) + 1)
    squares = _square(disc, fills)
    curve = spline(fills, squares - squares[0])
    between = fills[:-1, None] + np.diff(fills)[:, None] * _WITHIN_PIECE
    missed = np.abs(curve(between) + squares[0] - _square(disc, between)).reshape(count - 1, -1).max(axis=1)
    return squares, np.maximum(np.append(missed[:1], missed), np.append(missed, missed[-1:]))


def _square(disc: Disc, fills: FloatArray) -> FloatArray:
    return head_square(disc=disc, surface_radius=surface_radius(disc=disc, fill_ratio=fills))
