"""The model hierarchies of a chamber: wall pressure, moment and lambda, from formulas to finite elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, lru_cache, partial
from typing import Final, NamedTuple

import numpy as np

from ringbalance.mesh.chamber import default_cells
from ringbalance.mesh.cut.tilted import tilted_liquid
from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.sloshing.range import FREQUENCY_UNCERTAINTY
from ringbalance.physics.sloshing.response import sloshing_response
from ringbalance.physics.sloshing.system import imported_system
from ringbalance.reduced_model.chamber.element_check import ImportedElements, scene_ring
from ringbalance.reduced_model.chamber.range import chamber_fills, chamber_status
from ringbalance.reduced_model.chamber.terms import (
    MEAN,
    PLATES,
    RIPPLE,
    SLOSHING,
    amplification,
    capillary_share,
    chamber_contributions,
)
from ringbalance.reduced_model.chamber.tilted_ring import POINTS, RADIAL_POINTS, turn_samples
from ringbalance.reduced_model.chamber.values import (
    ChamberValues,
    by_closed_form,
    by_paper,
    by_quadrature,
    drawing_shares,
)
from ringbalance.reduced_model.contribution import Contribution, percent
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, Work

_COARSE_MESH: Final = "coarse mesh"
_FINE_MESH: Final = "fine mesh"
_STEP: Final = 0.01
"""Of the fill ratio, for the slope of the moment."""
_SWING_MESH: Final = 2e-3
"""Discretisation error of the amplification near resonance, relative, on the safe side."""
_GRAVITY_SWEEPS: Final = 5
"""Solves that one tilted surface takes, about."""
_SLOSHING_MODEL: Final = "1x response with Coriolis force and wall layers, finite elements"
_PARTS: Final = {"pressures": ChamberValues.pressures, "moments": ChamberValues.moments}


class _Kind(NamedTuple):
    """A model of both model hierarchies."""

    name: str
    solver: Callable[[float], ChamberValues]
    """From the fill ratio."""
    lacks: tuple[str, ...]
    work: Work
    solution: str = ""
    """The name, unless given."""
    swings: bool = False
    """Whether gravity's ripples are those of the swinging liquid."""

    def models(self) -> Mapping[str, str]:
        """Model of each part, for people."""
        found = {
            "plates": "none" if PLATES in self.lacks else "exact",
            "gravity": "left out" if MEAN in self.lacks else "all orders",
            "solution": self.solution or self.name,
        }
        return {**found, "sloshing": _SLOSHING_MODEL} if self.swings else found


def chamber_hierarchies(scene: Scene) -> tuple[ModelHierarchy, ModelHierarchy]:
    """The model hierarchies of wall pressure and of moment with lambda; a ring must exist.

    Without a fill at which the ring is closed they have no points, and their status says so.
    """
    fills, kinds, meshes = chamber_fills(scene), _kinds(scene), _mesh_contributions(scene)
    terms = {part: {**found, **meshes} for part, found in chamber_contributions(scene, fills).items()}
    solvers = [cache(kind.solver) for kind in kinds]
    floor = meshes[_FINE_MESH].value or 0.0

    def fidelity(kind: _Kind, solver: Callable[[float], ChamberValues], part: str) -> Fidelity:
        def fresh(point: int) -> ChamberValues:
            forget_solves()
            return kind.solver(float(fills[point]))

        return Fidelity(
            name=kind.name,
            models=kind.models(),
            leaves_out=frozenset(kind.lacks),
            work=kind.work,
            solve=lambda point: _PARTS[part](solver(float(fills[point]))),
            fresh=fresh,
        )

    def hierarchy(quantity: str, title: str, values: tuple[str, ...], part: str) -> ModelHierarchy:
        capillary = float(np.max(capillary_share(scene, fills)[part], initial=0.0))
        swing = _swing_uncertainty(scene, fills, terms, part)
        return ModelHierarchy(
            quantity=quantity,
            title=title,
            values=values,
            points=tuple(f"fill ratio {x:.3g}" for x in fills),
            check=tuple(range(fills.size)),
            relative_to="each",
            contributions=terms[part],
            fidelities=tuple(fidelity(*each, part) for each in zip(kinds, solvers, strict=True)),
            top_uncertainty=float(np.sqrt(floor**2 + capillary**2 + swing**2)),
            top_uncertainty_from=(
                f"grid convergence, about {floor:.1e}; surface tension, which no model includes, up to "
                f"{capillary:.1e}; waves at frequencies that are known to {percent(FREQUENCY_UNCERTAINTY)}, "
                f"and beyond linear sloshing, about {swing:.1e}"
            ),
            status=chamber_status(scene),
        )

    pressure = ("mean over a turn, Pa", "largest over a turn, Pa")
    moment = ("mean over a turn, kg m", "largest over a turn, kg m", "lambda of added liquid, m")
    return (
        hierarchy("wall_pressure", "wall pressure", pressure, "pressures"),
        hierarchy("moment", "moment and lambda", moment, "moments"),
    )


def _swing_uncertainty(
    scene: Scene, fills: FloatArray, terms: Mapping[str, Mapping[str, Contribution]], part: str
) -> float:
    """What linear sloshing leaves open: its square, its meshes, what its frequencies' uncertainty moves.

    At most 1: nothing is known then.
    """
    if scene.environment.shaft == "vertical":
        return 0.0
    swing = amplification(scene, fills)
    factor = float(np.max(swing.largest, initial=1.0))
    ripple, sloshing = (terms[part][term].value or 0.0 for term in (RIPPLE, SLOSHING))
    between = ripple * float(np.max(swing.largest - swing.lowest, initial=0.0))
    waves = ((terms["pressures"][RIPPLE].value or 0.0) * factor) ** 2
    return min(waves + between + _SWING_MESH * sloshing, 1.0)


def _mesh_error(scene: Scene, angular_cells: int) -> float:
    """Discretisation error of a mesh, relative: an arc drawn by cells of angle h, (h/2)^4/32 R2/depth.

    Returns: Share of the wall pressure at a fifth of the largest fill.
    Source: remainder of a quadratic interpolation of a circle.
    """
    outer = scene.disc.outer_radius
    surface = float(surface_radius(disc=scene.disc, fill_ratio=0.2 * scene.disc.max_fill_ratio))
    h = scene.disc.central_angle / angular_cells
    return (h / 2) ** 4 / 32 * outer / (outer - surface)


def _mesh_contributions(scene: Scene) -> Mapping[str, Contribution]:
    """Contributions of the meshes' errors, by name; of an imported chamber what its facets leave."""
    formula, source = "(h/2)^4/32 R2/depth", "a circle's interpolation"
    if scene.disc.geometry is not None:
        shares = drawing_shares(scene.disc, np.array([0.2 * scene.disc.max_fill_ratio]))
        errors = {_FINE_MESH: float(max(shares.wall_pressure[0], shares.moment[0]))}
        formula, source = "h delta/12", "an arc of angle delta over a facet"
    else:
        meshes = zip((_COARSE_MESH, _FINE_MESH), _meshes(scene, 2), strict=True)
        errors = {term: _mesh_error(scene, cells[1]) for term, cells in meshes}
    return {
        term: Contribution(term=term, value=value, formula=formula, source=source)
        for term, value in errors.items()
    }


def _meshes(scene: Scene, dimension: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Coarse and fine."""
    fine = default_cells(disc=scene.disc, dimension=dimension)
    return tuple(max(4, n // 2) for n in fine), fine


def _kinds(scene: Scene) -> tuple[_Kind, ...]:
    """All models of a chamber; the last one leaves nothing out but the errors of meshes.

    A free surface that follows gravity at once leaves sloshing out; gravity along the shaft makes none.
    """
    still = scene.environment.gravity == 0
    swing = () if still or scene.environment.shaft == "vertical" else (SLOSHING,)
    # Without gravity, or along the shaft, these are nothing; their estimates say so.
    pull = (RIPPLE, MEAN, SLOSHING)
    paper = _Kind("the paper's formula", partial(by_paper, scene), (PLATES, *pull), {"formula": 4})
    exact = _Kind("closed form", partial(by_closed_form, scene), pull, {"formula": 30})
    tilted_work = {"quadrature": _turns(scene) * POINTS * RADIAL_POINTS, "formula": 60}
    turned = _Kind("quadrature, gravity to all orders", partial(by_quadrature, scene), swing, tilted_work)
    if scene.disc.geometry is not None:
        walls = "integrals over the walls"
        turned = turned._replace(name=f"{walls}, gravity to all orders")
        work = {"solve": 9.0, "unknown_3d": 30.0 * len(scene.disc.geometry.cells)}
        solver, lacks = partial(_by_imported_elements, scene), (_FINE_MESH, *pull)
        elements = _Kind("3-D finite elements on its mesh", solver, lacks, work)
        found = [paper, exact._replace(name=walls, solution="walls"), elements, *[turned] * (not still)]
        return (*found, *(_swinging(scene, turned) for _ in swing))
    coarse, fine = (_elements(scene, cells, swing) for cells in _meshes(scene, 2))
    solid = _elements(scene, _meshes(scene, 3)[0], swing)
    if still:
        return paper, exact, coarse, solid, fine
    tilted = [
        _elements(scene, cells, swing, gravity=True)
        for cells in _meshes(scene, 2 if scene.environment.shaft == "horizontal" else 3)
    ]
    found = [paper, exact, turned, coarse, fine, solid, *tilted]
    return (*found, *(_swinging(scene, kind) for kind in (turned, tilted[-1]) if swing))


def _turns(scene: Scene) -> int:
    return 1 if scene.environment.shaft == "vertical" else turn_samples(scene)


def _mesh_turns(scene: Scene) -> int:
    """Angles of gravity that the finite elements take for a mean within 1e-8."""
    if scene.environment.shaft == "vertical":
        return 1
    tilt = scene.environment.gravity / (scene.rotor.speed**2 * scene.disc.inner_radius)
    return 2 * max(2, int(np.ceil(np.log(1e-8) / np.log(min(tilt, 0.3)) / 2)))


def _elements(
    scene: Scene, cells: tuple[int, ...], swing: tuple[str, ...], *, gravity: bool = False
) -> _Kind:
    """Finite elements on a mesh and two coarser ones."""
    dimension = len(cells)
    mesh = _FINE_MESH if cells == _meshes(scene, dimension)[1] else _COARSE_MESH
    solves = _mesh_turns(scene) * _GRAVITY_SWEEPS if gravity else 1
    unknowns = sum(float(np.prod([2 * (n // k) + 1 for n in cells])) for k in (1, 2, 4))
    named = " x ".join(str(n) for n in cells)
    return _Kind(
        name=f"{dimension}-D finite elements, {named} cells{', with gravity' if gravity else ''}",
        solver=partial(by_elements, scene, cells=cells, gravity=gravity),
        lacks=(mesh, *swing, *(() if gravity else (RIPPLE, MEAN))),
        work={"solve": 3.0 * solves, f"unknown_{dimension}d": unknowns * solves},
        solution=named,
    )


@lru_cache(maxsize=256)
def by_elements(scene: Scene, fill: float, *, cells: tuple[int, ...], gravity: bool) -> ChamberValues:
    """Finite elements on a mesh and the two coarser ones that its grid convergence needs.

    Source: `ring_quantities`.
    """
    meshes = tuple(tuple(max(1, n // k) for n in cells) for k in (1, 2, 4))
    found = scene_ring(scene, fill_ratio=[fill], gravity=gravity, cells=meshes)
    return ChamberValues(
        wall_pressure=float(found.wall_pressure.value[0]),
        wall_pressure_ripple=float(found.ripple["wall_pressure"][0]),
        moment=float(found.moment.value[0]),
        moment_ripple=float(found.ripple["moment"][0]),
        moment_per_mass=2 * float(found.moment_per_volume.value[0]) / scene.liquid.density,
    )


def _by_imported_elements(scene: Scene, fill: float) -> ChamberValues:
    """Without gravity; lambda as the change of the moment between two neighbouring fills."""
    geometry = scene.disc.geometry
    if geometry is None:
        raise ValueError("the scene's chamber is not imported")
    step = min(_STEP, fill / 2, (1 - fill) / 2)
    found = ImportedElements.of(scene, geometry, fill_ratio=np.array([fill, fill - step, fill + step]))
    at, low, high = found.moment.value
    mass = scene.liquid.density * float(found.volume[2] - found.volume[1])
    return ChamberValues(
        wall_pressure=float(found.wall_pressure.value[0]),
        moment=float(at),
        moment_per_mass=2 * float(high - low) / mass,
    )


def _swinging(scene: Scene, still: _Kind) -> _Kind:
    """A quasi-static model with its ripples as the swinging liquid makes them."""
    sides = sum(float(angular) ** 3 for _, angular in _sloshing_meshes(scene))

    def solver(fill: float) -> ChamberValues:
        found, (of_pressure, of_moment) = still.solver(fill), _sloshing_factors(scene, fill)
        return replace(
            found,
            wall_pressure_ripple=of_pressure * found.wall_pressure_ripple,
            moment_ripple=of_moment * found.moment_ripple,
        )

    return _Kind(
        name=f"{still.name}, sloshing",
        solver=solver,
        lacks=tuple(term for term in still.lacks if term != SLOSHING),
        work={**still.work, "sloshing": sides},
        solution=still.solution or still.name,
        swings=True,
    )


def _sloshing_meshes(scene: Scene) -> tuple[tuple[int, int], ...]:
    """Meshes on which the swinging liquid is solved, finest first: half as fine as for frequencies."""
    radial, angular = default_cells(disc=scene.disc)
    return tuple((radial // k, angular // k) for k in (1, 2, 4))


@lru_cache(maxsize=256)
def _sloshing_factors(scene: Scene, fill: float) -> tuple[float, float]:
    """How much the swinging liquid enlarges gravity's ripples of wall pressure and of moment.

    Source: `sloshing_response`.
    """
    found = sloshing_response(
        disc=scene.disc,
        fill_ratio=[fill],
        angular_velocity=abs(scene.rotor.speed),
        kinematic_viscosity=scene.liquid.kinematic_viscosity,
        gravity=scene.environment.gravity,
        cells=_sloshing_meshes(scene),
    )
    return float(found.pressure_amplification.value[0]), float(found.amplification.value[0])


def forget_solves() -> None:
    """Do every solve again when it is next asked for, so that it can be timed."""
    for kept in (by_elements, _sloshing_factors, tilted_liquid, imported_system):
        kept.cache_clear()
