"""Finite-element rings that several cases share: each is computed once per process."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.physics.results import Estimate
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.comparison import from_half_width
from ringbalance.verification.evidence import Convergence, Found
from ringbalance.verification.paper_numbers import plate_uncertainty, with_plate
from ringbalance.verification.published import conclusive
from ringbalance.verification.reference.exact_chamber import exact_moment
from ringbalance.verification.sensitivity import input_uncertainty


@lru_cache(maxsize=64)
def ring(
    *, disc: Disc, density: float, angular_velocity: float, fills: tuple[float, ...], dimension: int = 2
) -> RingQuantities:
    """Finite-element totals without gravity.

    Args: `density`: rho, kg/m^3. `angular_velocity`: omega, rad/s. `fills`: fill ratios. `dimension`: 2 or 3.
    """
    return ring_quantities(
        disc=disc,
        density=density,
        angular_velocity=angular_velocity,
        fill_ratio=fills,
        dimension=dimension,
    )


def ring_of(scene: Scene, fills: tuple[float, ...], *, dimension: int = 2) -> RingQuantities:
    """Finite-element totals of a scene's disc, liquid and speed, without gravity.

    Args: `fills`: fill ratios. `dimension`: 2 or 3.
    """
    return ring(
        disc=scene.disc,
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        fills=fills,
        dimension=dimension,
    )


def found_of(quantities: RingQuantities, name: str, index: int, *, input_: float = 0.0) -> Found:
    """One number of a ring with its uncertainties.

    Args: `name`: "liquid_volume", "wall_pressure", "moment" or "moment_per_volume". `index`: of the fill
        ratio. `input_`: standard uncertainty from the inputs, in the number's unit.
    Returns: Found; not conclusive where the meshes do not converge steadily.
    """
    estimate: Estimate = getattr(quantities, name)
    return Found(
        value=float(estimate.value[index]),
        numerical=from_half_width(float(estimate.uncertainty[index])),
        input=input_,
        conclusive=quantities.status.ok and conclusive(quantities.convergence[name][index]),
    )


def scaled(found: Found, factor: float) -> Found:
    """A found number times a constant.

    Args: `factor`: the constant, positive.
    Returns: The product with its uncertainties.
    """
    return dataclasses.replace(
        found, value=found.value * factor, numerical=found.numerical * factor, input=found.input * factor
    )


def moment_standard_uncertainty(scene: Scene, fill_ratio: float) -> float:
    """What the plate thickness's uncertainty does to a chamber's moment at a given fill ratio.

    Args: `fill_ratio`: x.
    Returns: Standard uncertainty, kg m.
    """

    def moment(thickness: float) -> float:
        disc = with_plate(scene.disc, thickness)
        return float(exact_moment(disc=disc, density=scene.liquid.density, fill_ratio=fill_ratio))

    return input_uncertainty([(moment, scene.disc.plate_thickness, plate_uncertainty(scene))])


def mesh_table(quantities: RingQuantities, name: str, unit: str, index: int) -> Convergence:
    """Convergence of one number of a ring over its meshes.

    Args: `name`: "liquid_volume", "wall_pressure", "moment" or "moment_per_volume". `unit`: SI. `index`: of
        the fill ratio.
    Returns: Convergence, coarse to fine.
    """
    record = quantities.convergence[name][index]
    values = quantities.mesh_values[name][::-1, index]
    sizes = [quantities.cells[-1][0] / cells[0] for cells in reversed(quantities.cells)]
    estimate: Estimate = getattr(quantities, name)
    finest = float(estimate.value[index])
    return Convergence(
        quantity=name.replace("_", " "),
        unit=unit,
        formal_order=4.0,
        size=sizes,
        value=values.tolist(),
        observed_order=(record.observed_order,),
        gci=float(estimate.uncertainty[index]) / abs(finest) if finest else None,
        geometry="quadratic",
        note=f"{' x '.join(map(str, quantities.cells[0]))} cells on the finest mesh; {record.text}",
    )
