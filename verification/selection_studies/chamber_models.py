"""The model hierarchies of a chamber: wall pressure, moment and lambda, from formulas to finite elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from ringbalance.mesh.chamber import default_cells
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
)
from ringbalance.reduced_model.contribution import Contribution
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.selection_studies.chamber_elements import (
    COARSE_MESH,
    FINE_MESH,
    by_elements,
    by_imported_elements,
    forget_solves,
    mesh_contributions,
    sloshing_meshes,
    with_sloshing,
)
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, Work

_SWING_MESH: Final = 2e-3
"""Discretisation error of the amplification near resonance, relative, on the safe side."""
GRAVITY_SWEEPS: Final = 5
"""Solves that one tilted surface takes, about."""

Solver = Callable[[Scene, float], ChamberValues]
Memo = dict[tuple[str, int], ChamberValues]


@dataclass(frozen=True, kw_only=True)
class _Kind:
    """A model of both model hierarchies."""

    name: str
    models: Mapping[str, str]
    lacks: tuple[str, ...]
    solver: Solver
    work: Work


def chamber_hierarchies(scene: Scene) -> tuple[ModelHierarchy, ModelHierarchy]:
    """The model hierarchies of wall pressure and of moment with lambda; a ring must exist.

    Without a fill at which the ring is closed they have no points, and their status says so.
    """
    fills = chamber_fills(scene)
    kinds = _kinds(scene)
    status = chamber_status(scene)
    meshes = mesh_contributions(scene)
    terms = {part: {**found, **meshes} for part, found in chamber_contributions(scene, fills).items()}
    floor = meshes[FINE_MESH].value or 0.0
    capillary = {part: np.max(s, initial=0.0) for part, s in capillary_share(scene, fills).items()}
    swing = _swing_uncertainty(scene, fills, terms)
    memo: Memo = {}
    labels = tuple(f"fill ratio {x:.3g}" for x in fills)
    check = tuple(range(fills.size))

    def hierarchy(quantity: str, title: str, values: tuple[str, ...], part: str) -> ModelHierarchy:
        return ModelHierarchy(
            quantity=quantity,
            title=title,
            values=values,
            points=labels,
            check=check,
            relative_to="each",
            contributions=terms[part],
            fidelities=tuple(_fidelity(scene, fills, kind, part, memo) for kind in kinds),
            top_uncertainty=float(np.sqrt(floor**2 + capillary[part] ** 2 + swing[part] ** 2)),
            top_uncertainty_from=(
                f"grid convergence, about {floor:.1e}; surface tension, which no model includes, up to "
                f"{capillary[part]:.1e}; waves beyond linear sloshing, about {swing[part]:.1e}"
            ),
            status=status,
        )

    pressure = ("mean over a turn, Pa", "largest over a turn, Pa")
    moment = ("mean over a turn, kg m", "largest over a turn, kg m", "lambda of added liquid, m")
    return (
        hierarchy("wall_pressure", "wall pressure", pressure, "pressures"),
        hierarchy("moment", "moment and lambda", moment, "moments"),
    )


def _swing_uncertainty(
    scene: Scene, fills: FloatArray, terms: Mapping[str, Mapping[str, Contribution]]
) -> Mapping[str, float]:
    """What linear sloshing leaves open: its square, and the meshes of the swinging liquid."""
    factor = float(np.max(amplification(scene, fills), initial=1.0))
    if scene.environment.shaft == "vertical":
        return {"pressures": 0.0, "moments": 0.0}

    def of(part: str, term: str) -> float:
        return terms[part][term].value or 0.0

    waves = (of("pressures", RIPPLE) * factor) ** 2
    return {part: waves + _SWING_MESH * of(part, SLOSHING) for part in ("pressures", "moments")}


def _fidelity(scene: Scene, fills: FloatArray, kind: _Kind, part: str, memo: Memo) -> Fidelity:
    def solve(point: int) -> FloatArray:
        key = (kind.name, point)
        if key not in memo:
            memo[key] = kind.solver(scene, float(fills[point]))
        return memo[key].pressures() if part == "pressures" else memo[key].moments()

    def fresh(point: int) -> ChamberValues:
        forget_solves()
        return kind.solver(scene, float(fills[point]))

    return Fidelity(
        name=kind.name,
        models=kind.models,
        leaves_out=frozenset(kind.lacks),
        work=kind.work,
        solve=solve,
        fresh=fresh,
    )


def _kinds(scene: Scene) -> tuple[_Kind, ...]:
    pull = (RIPPLE, MEAN, SLOSHING)
    plain = (
        _kind("the paper's formula", "none", "left out", (PLATES, *pull), by_paper, formula=4),
        _kind("closed form", "exact", "left out", pull, by_closed_form, formula=30),
    )
    if scene.disc.geometry is not None:
        return _imported_kinds(scene, plain, len(scene.disc.geometry.cells))
    meshes = tuple(_mesh_kind(scene, cells, heavy=False) for cells in _meshes(scene, 2))
    solid = _mesh_kind(scene, _meshes(scene, 3)[0], heavy=False)
    if scene.environment.gravity == 0:
        return (*plain, *meshes[:1], solid, meshes[1])
    gravity = _to_all_orders(scene, "quadrature")
    dimension = 3 if scene.environment.shaft == "vertical" else 2
    tilted = tuple(_mesh_kind(scene, cells, heavy=True) for cells in _meshes(scene, dimension))
    quasi_static = (*plain, gravity, *meshes, solid, *tilted)
    if not _swing(scene):
        return quasi_static
    return (*quasi_static, _swinging(scene, gravity), _swinging(scene, tilted[-1]))


def _swing(scene: Scene) -> tuple[str, ...]:
    """What a free surface that follows gravity at once leaves out."""
    still = scene.environment.shaft == "vertical" or scene.environment.gravity == 0
    return () if still else (SLOSHING,)


def _to_all_orders(scene: Scene, name: str) -> _Kind:
    """Integrals over the tilted liquid at every angle of the turn."""
    return _kind(
        f"{name}, gravity to all orders",
        "exact",
        "all orders",
        _swing(scene),
        by_quadrature,
        quadrature=_turns(scene) * POINTS * RADIAL_POINTS,
        formula=60,
    )


def _imported_kinds(scene: Scene, plain: tuple[_Kind, ...], cells: int) -> tuple[_Kind, ...]:
    """Of an imported chamber, which has one mesh; the closed form stands for integrals over its walls.

    Args: `cells`: how many its mesh has.
    """
    gravity = scene.environment.gravity
    pull = () if gravity == 0 else (RIPPLE, MEAN, SLOSHING)
    paper, exact = plain
    walls = replace(exact, name="integrals over the walls", models={**exact.models, "solution": "walls"})
    elements = _kind(
        "3-D finite elements on its mesh",
        "exact",
        "left out",
        (FINE_MESH, *pull),
        by_imported_elements,
        solve=9.0,
        unknown_3d=30.0 * cells,
    )
    if gravity == 0:
        return paper, walls, elements
    tilted = _to_all_orders(scene, "integrals over the walls")
    still = (paper, walls, elements, tilted)
    return (*still, _swinging(scene, tilted)) if _swing(scene) else still


def _swinging(scene: Scene, still: _Kind) -> _Kind:
    """A quasi-static model with its ripples as the swinging liquid makes them."""
    sides = sum(float(angular) ** 3 for _, angular in sloshing_meshes(scene))
    return _Kind(
        name=f"{still.name}, sloshing",
        models={
            **still.models,
            "sloshing": "1x response with Coriolis force and wall layers, finite elements",
        },
        lacks=tuple(term for term in still.lacks if term != SLOSHING),
        solver=partial(with_sloshing, still=still.solver),
        work={**still.work, "sloshing": sides},
    )


def _kind(
    name: str, plates: str, gravity: str, lacks: tuple[str, ...], solver: Solver, **work: float
) -> _Kind:
    models = {"plates": plates, "gravity": gravity, "solution": name}
    return _Kind(name=name, models=models, lacks=lacks, solver=solver, work=work)


def _turns(scene: Scene) -> int:
    if scene.environment.shaft == "vertical":
        return 1
    return turn_samples(scene)


def _meshes(scene: Scene, dimension: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Coarse and fine."""
    fine = default_cells(disc=scene.disc, dimension=dimension)
    coarse = tuple(max(4, n // 2) for n in fine)
    return coarse, fine


def _mesh_kind(scene: Scene, cells: tuple[int, ...], *, heavy: bool) -> _Kind:
    """Finite elements on a mesh and two coarser ones; with gravity when `heavy`."""
    fine = cells == default_cells(disc=scene.disc, dimension=len(cells))
    lacks = (FINE_MESH if fine else COARSE_MESH, *_swing(scene), *(() if heavy else (RIPPLE, MEAN)))
    solves = _mesh_turns(scene) * GRAVITY_SWEEPS if heavy else 1
    unknowns = sum(float(np.prod([2 * (n // k) + 1 for n in cells])) for k in (1, 2, 4))
    named = " x ".join(str(n) for n in cells)
    held = ", with gravity" if heavy else ""
    kind = f"unknown_{len(cells)}d"
    return _Kind(
        name=f"{len(cells)}-D finite elements, {named} cells{held}",
        models={"plates": "exact", "gravity": "all orders" if heavy else "left out", "solution": named},
        lacks=lacks,
        solver=partial(by_elements, cells=cells, gravity=heavy),
        work={"solve": 3.0 * solves, kind: unknowns * solves},
    )


def _mesh_turns(scene: Scene) -> int:
    """Angles of gravity that the finite elements take for a mean within 1e-8."""
    if scene.environment.shaft == "vertical":
        return 1
    tilt = scene.environment.gravity / (scene.rotor.speed**2 * scene.disc.inner_radius)
    return 2 * max(2, int(np.ceil(np.log(1e-8) / np.log(min(tilt, 0.3)) / 2)))
