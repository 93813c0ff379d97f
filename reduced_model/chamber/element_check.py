"""Check of a chamber's closed forms by finite elements at a few fills, on the mesh that the tolerance
needs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.chamber_table import TOLERANCE, chamber_table
from ringbalance.mesh.geometry import chamber_volume, surface_radius
from ringbalance.physics.pressure.loads import solved_ring
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.physics.results import Estimate, Statistics, Status, StatusCode
from ringbalance.reduced_model.chamber.values import RingValues, chamber_closed_forms, chamber_pressure
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.chamber_file.record import OUTER_WALL, ChamberGeometry
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Disc, Scene

CHECKED: Final = ("wall_pressure", "moment", "moment_per_volume", "hydrostatic_pressure")
"""Names of the checked quantities: of an imported chamber all but the third; of the built-in sector, whose
wall has one radius, all but the last."""
_CHECKED_ON_WALLS: Final = ("wall_pressure", "moment", "hydrostatic_pressure")
_STAND_IN: Final = {"moment_per_volume": "moment", "hydrostatic_pressure": "wall_pressure"}
"""Quantity that is checked instead, by the one that is not."""
_MESH_SHARE: Final = 0.1
"""Allowed error of the mesh over the tolerance, at the thinnest ring checked; in an imported chamber, of the
surface at any fill."""
_RADIAL_CELLS: Final = 4
"""Cells along the radius. The pressure is quadratic and so are the cells: only the arcs need more."""
_SMALLEST_CELL_RAD: Final = math.pi / 48
_CUT_ERROR: Final = 1e-6
"""Relative error of totals by cut walls, which are remeshed by the parts of their cells."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ElementCheck:
    """Results of finite elements at a few fills, and the deviation of the closed forms from them."""

    elements: RingQuantities | ImportedElements
    """Totals at the checked fills, with half-widths by grid convergence."""
    gravity: bool
    """True if the elements include gravity."""
    difference: Mapping[str, FloatArray]
    """Closed form less finite elements, by `CHECKED`, SI, shape (n,)."""
    allowed: Mapping[str, FloatArray]
    """Allowed difference: sum of both half-widths (95 %), by `CHECKED`, SI, shape (n,)."""
    excesses: Mapping[str, float]
    """Largest excess over the allowed difference, relative to the value, by `CHECKED`; zero without one."""
    status: Status

    @property
    def excess(self) -> float:
        """Largest relative excess over the allowed difference, of all quantities."""
        return max(self.excesses.values())

    def excess_of(self, quantity: str) -> float:
        """Relative excess of a quantity of `CHECKED`, or of the one that is checked instead."""
        return self.excesses[quantity if quantity in self.excesses else _STAND_IN[quantity]]

    def status_of(self, quantity: str) -> Status:
        """NOT_CONVERGED where finite elements failed, or contradict this quantity."""
        return _status(self.elements, self.excess_of(quantity))

    @classmethod
    def of(cls, scene: Scene, *, values: RingValues, gravity: bool) -> ElementCheck:
        """Solve the pressure at the thinnest ring of the table and at the largest fill.

        An imported chamber is solved without gravity and compared with the integrals over its walls.

        Args: `values`: results of the closed forms. `gravity`: true if these include gravity.
        Returns: ElementCheck; its status is NOT_CONVERGED where the two differ by more than both errors, or
            where the finite elements have no solution for the tilted surface.
        Raises: SceneError: as `scene_ring`, a chamber so narrow that nothing could be checked.
        """
        # The thinnest ring and the largest fill.
        fills = values.fill_ratio
        thinnest = float(fills[fills > 0].min())
        at = np.array([int(np.argmin(np.abs(fills - x))) for x in (thinnest, fills.max())])
        if scene.disc.geometry is not None:
            fills = fills[at]
            pressure, moment, _ = chamber_closed_forms(scene=scene, fill_ratio=np.append(fills, 1.0))
            head = chamber_pressure(scene=scene, fill_ratio=np.append(fills, 1.0))
            # The error of the integrals' table is relative to the whole chamber.
            closed_forms = {
                name: Estimate(value=value[:-1], uncertainty=np.full(fills.shape, TOLERANCE * value[-1]))
                for name, value in zip(_CHECKED_ON_WALLS, (pressure, moment, head), strict=True)
            }
            solved = ImportedElements.of(scene, scene.disc.geometry, fill_ratio=fills)
            return _compared(closed_forms, solved, gravity=False)
        tilted = gravity and bool(np.any(values.closed[at]))
        at = at[values.closed[at]] if tilted else at
        elements = scene_ring(
            scene,
            fill_ratio=values.fill_ratio[at],
            gravity=tilted,
            cells=_meshes(
                scene.disc,
                scene.tolerance,
                float(values.fill_ratio[at].min()),
                dimension=3 if tilted and scene.environment.shaft == "vertical" else 2,
            ),
        )
        closed_forms = {}
        for name in (name for name in CHECKED if hasattr(elements, name)):
            estimate: Estimate = getattr(values, name)
            closed_forms[name] = Estimate(value=estimate.value[at], uncertainty=estimate.uncertainty[at])
        return _compared(closed_forms, elements, gravity=tilted)

    @property
    def solves(self) -> int:
        """Number of solves: meshes times fills."""
        return len(self.elements.cells) * self.elements.fill_ratio.size


def _compared(
    closed_forms: Mapping[str, Estimate], elements: RingQuantities | ImportedElements, *, gravity: bool
) -> ElementCheck:
    difference, allowed, excesses = {}, {}, {}
    for name, closed_form in closed_forms.items():
        solved: Estimate = getattr(elements, name)
        difference[name] = closed_form.value - solved.value
        allowed[name] = closed_form.uncertainty + solved.uncertainty
        beyond = (np.abs(difference[name]) - allowed[name]) / np.abs(closed_form.value)
        excesses[name] = max(0.0, float(np.max(beyond))) if elements.status.ok else 0.0
    return ElementCheck(
        elements=elements,
        gravity=gravity,
        difference=difference,
        allowed=allowed,
        excesses=excesses,
        status=_status(elements, max(excesses.values())),
    )


def _meshes(disc: Disc, tolerance: float, thinnest: float, *, dimension: int) -> tuple[tuple[int, ...], ...]:
    """Cells of three meshes, finest first: cells of angle h along an arc err by (h/2)^4/32 R2/depth."""
    depth = disc.outer_radius - float(surface_radius(disc=disc, fill_ratio=thinnest))
    angle = 2 * (32 * _MESH_SHARE * tolerance * depth / disc.outer_radius) ** 0.25
    angular = 4 * math.ceil(disc.central_angle / max(angle, _SMALLEST_CELL_RAD) / 4)
    finest = (_RADIAL_CELLS, max(8, angular), 4)[:dimension]
    return tuple(tuple(n // k for n in finest) for k in (1, 2, 4))


def _status(elements: RingQuantities | ImportedElements, excess: float) -> Status:
    if not elements.status.ok:
        text = f"the closed forms stand unchecked, because the finite elements failed: {elements.status.text}"
        return Status(code=StatusCode.NOT_CONVERGED, text=text)
    if excess > 0:
        text = (
            f"finite elements and closed forms differ by {excess:.1e} more than their errors allow: take "
            "that as the uncertainty, or lower accuracy.tolerance for a finer check"
        )
        return Status(code=StatusCode.NOT_CONVERGED, text=text)
    return Status()


def scene_ring(
    scene: Scene, *, fill_ratio: npt.ArrayLike, gravity: bool, cells: Sequence[tuple[int, ...]] | None = None
) -> RingQuantities:
    """Totals of one chamber's liquid; without gravity every fill must be solved.

    Args: `gravity`: true if gravity is modelled. `cells`: meshes, finest first; default as in
        `ring_quantities`.
    Raises: SceneError: a chamber so narrow or a ring so shallow that a solve failed; the numbers of a failed
        solve would enter the tables of all other fill ratios.
    """
    ring = ring_quantities(
        disc=scene.disc,
        density=scene.liquid.density,
        angular_velocity=scene.rotor.speed,
        fill_ratio=fill_ratio,
        gravity=scene.environment.gravity if gravity else 0.0,
        shaft=scene.environment.shaft,
        cells=cells,
    )
    if gravity or np.all(ring.solved):
        return ring
    fault = scene_fault(
        scene,
        "disc.central_angle",
        problem=f"the pressure in a chamber of this shape cannot be solved ({ring.status.text})",
        allowed="a wider chamber, or a thinner plate_thickness",
    )
    raise SceneError([fault])


@dataclass(frozen=True, kw_only=True, eq=False)
class ImportedElements:
    """Totals of one chamber's liquid without gravity, on the scene's own mesh cut along the free surface."""

    fill_ratio: FloatArray
    wall_pressure: Estimate
    """Mean pressure on the whole outer wall, dry parts included, Pa, shape (n,)."""
    hydrostatic_pressure: Estimate
    """Pressure at R2 by the volume of the meshed liquid, Pa, shape (n,)."""
    moment: Estimate
    """Moment of the chamber, kg m, shape (n,)."""
    volume: FloatArray
    """Volume of the meshed liquid, m^3, shape (n,)."""
    cells: tuple[tuple[int, ...], ...]
    """Number of cells of the scene's mesh."""
    status: Status
    statistics: Statistics

    @classmethod
    def of(cls, scene: Scene, geometry: ChamberGeometry, *, fill_ratio: FloatArray) -> ImportedElements:
        """Solve the pressure at a few fills, with the errors of the elements and of the meshed volume."""
        disc, density = scene.disc, scene.liquid.density
        radii, filled = (
            surface_radius(disc=disc, fill_ratio=fill_ratio),
            fill_ratio * chamber_volume(disc=disc),
        )
        rings = [
            solved_ring(
                geometry=geometry,
                density=density,
                angular_velocity=scene.rotor.speed,
                surface_radius=float(radius),
            )
            for radius in radii
        ]
        wall = chamber_table(geometry).wall_area
        wet = np.array([ring.loads[OUTER_WALL].area / wall for ring in rings])
        pressure = wet * np.array([float(ring.wall_pressure.value) for ring in rings])
        moment = np.array([ring.first_moment[0] for ring in rings])
        volume = np.array([ring.volume for ring in rings])
        surplus, volume_error = volume - filled, np.abs(volume / filled - 1)
        # The surface moves until the surplus of the meshed liquid is gone: da^2 = 2 dV/A on a free surface of
        # area a A, whose facets err by a fraction of the tolerance.
        head = chamber_pressure(scene=scene, fill_ratio=fill_ratio)
        area = chamber_table(geometry).surface(radii)[0]
        moved = density * scene.rotor.speed**2 * surplus / area
        status = next((ring.status for ring in rings if not ring.status.ok), Status())
        return cls(
            fill_ratio=fill_ratio,
            wall_pressure=Estimate(
                value=pressure,
                uncertainty=wet * np.array([float(ring.wall_pressure.uncertainty) for ring in rings])
                + _CUT_ERROR * pressure,
            ),
            hydrostatic_pressure=Estimate(
                value=head - moved, uncertainty=_MESH_SHARE * scene.tolerance * head
            ),
            # Quadratic facets of the free surface remove or add liquid at the surface alone.
            moment=Estimate(value=moment, uncertainty=(_CUT_ERROR + 2 * volume_error) * np.abs(moment)),
            volume=volume,
            cells=((len(geometry.cells),),),
            status=status,
            statistics=rings[-1].statistics,
        )
