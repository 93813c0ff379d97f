"""A tube with two bends over a crest, turning, solved in three dimensions; a heavy run."""

from __future__ import annotations

import dataclasses
import sys
from typing import Final

import numpy as np

from ringbalance.physics.convergence import gci
from ringbalance.physics.tube.friction import rotation_reynolds_number
from ringbalance.physics.tube.loss import tube_loss
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    CaseTable,
    Convergence,
    Evidence,
    FigureCurve,
    Found,
    Level,
    figure,
)
from ringbalance.verification.navier_stokes.tube import SectionMesh
from ringbalance.verification.reference.bent_tube import BentTubeFlow, Segment, bend_shift

REYNOLDS: Final = 200.0
VISCOSITY_M2_S: Final = 20e-6
"""Kinematic viscosity of a silicone oil, m^2/s."""
LEG_IN, HUMP, LEG_OUT = 3.0, 6.0, 12.0
"""Straight lengths over the bore."""
_MESHES: Final = ((2, 2, 1.0), (2, 3, 1.5), (3, 4, 2.1))
"""Cells around, cells across, and cells along over those of the coarsest mesh; coarse to fine."""
_FORMAL_ORDER: Final = 4.0
_DEVELOPED_BORES: Final = (5.0, 1.0)
"""Ends of the part with developed flow, bores before the outlet."""


def path_over_crest(scene: Scene, refinement: float) -> tuple[Segment, ...]:
    """Leg, bend to the right, over the crest, bend to the right, leg; lengths over the bore.

    Args: `refinement`: cells along the path over those of the coarsest mesh.
    """
    bend = scene.tube.bends[0]

    def cells(count: int) -> int:
        return max(1, round(refinement * count))

    radius = bend.radius / scene.tube.bore
    arc = Segment(length=bend.angle * radius, turn=-bend.angle, cells=cells(5))
    return (
        Segment(length=LEG_IN, cells=cells(4), ratio=0.4),
        arc,
        Segment(length=HUMP / 2, cells=cells(5), ratio=1.5),
        Segment(length=HUMP / 2, cells=cells(5), ratio=1 / 1.5),
        arc,
        Segment(length=LEG_OUT, cells=cells(14), ratio=3.0),
    )


def _solve(
    scene: Scene, mesh: tuple[int, int, float], rotation: float, coriolis_factor: float
) -> BentTubeFlow:
    """The flow on one of `_MESHES`. Raises: ArithmeticError: Newton's method failed."""
    around, across, refinement = mesh
    flow = BentTubeFlow.of(
        segments=path_over_crest(scene, refinement),
        cells=SectionMesh(around=around, across=across, wall_ratio=3.0),
        reynolds=REYNOLDS,
        rotation_reynolds=rotation,
        coriolis_factor=coriolis_factor,
        # With less Coriolis force the initial guess is further from the flow.
        first_inertia=1.0 if coriolis_factor == 1.0 else 0.5,
        progress=lambda text: print(f"bent_tube_3d: {text}", file=sys.stderr, flush=True),
    )
    if not flow.solution.status.ok:
        raise ArithmeticError(flow.solution.status.text)
    return flow


def bent_tube_3d(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """A tube with two bends over a crest, turning, solved in three dimensions; a heavy run."""
    rotation = rotation_reynolds_number(
        angular_velocity=scene.rotor.speed, bore=scene.tube.bore, kinematic_viscosity=VISCOSITY_M2_S
    )
    losses: list[float] = []
    for mesh in _MESHES if defect is None else _MESHES[1:2]:
        # Only the latest flow is kept, since each takes hundreds of megabytes.
        flow = _solve(scene, mesh, rotation, 1.0 if defect is None else 0.5)
        losses.append(flow.pressure_loss(start=0.0, end=float(flow.arc_length[-1])))
    s, k = flow.arc_length, losses[-1]
    end = float(s[-1])
    half_width, convergence = (0.0, ()) if defect is not None else _converged(scene, losses)
    terms = _law_terms(scene, end, rotation)
    plain = terms["friction"] + terms["rotation"]
    with_bends, explained = plain + terms["bends"], plain + terms["shift"]
    # Gradient where flow has developed again, for the ratio to that of the table.
    first, last = (end - distance for distance in _DEVELOPED_BORES)
    gradient = REYNOLDS / 2 * flow.pressure_loss(start=first, end=last) / (last - first)
    ratio = rotating_friction_ratio(reynolds=REYNOLDS, rotation_reynolds=rotation)
    straight = gradient / (32 * float(ratio.value))
    loss = np.array([flow.pressure_loss(start=0.0, end=float(station)) for station in s])
    shown = figure(
        "loss along the path beyond that of the straight turning tube",
        ("arc length over bore", "1", s),
        FigureCurve("three dimensions", "1", loss - 2 / flow.reynolds * flow.gradient * s),
    )
    rows = {
        "friction of the whole length": terms["friction"],
        "rotation": terms["rotation"],
        "bends beyond the friction of their arcs, by the tube law": terms["bends"],
        "bends in three dimensions": k - plain,
        "bends as curvature added to rotation": terms["shift"],
    }
    table = CaseTable(
        name="what the loss coefficient of the bent tube is made of",
        columns={"term": list(rows), "K": list(rows.values())},
    )
    return Evidence(
        quantities={
            "straight": Found(value=straight).against(1.0),
            "explained": Found(value=k / explained, numerical=half_width / explained / 2).against(1.0),
            "convergence": Found(value=half_width / k),
        },
        numbers={
            **terms,
            "k": k,
            "unknowns": flow.solution.statistics.unknowns,
            "rotation_reynolds": rotation,
            "reynolds": REYNOLDS,
            "bends_found": k - plain,
            "sum": with_bends,
            "sum_gap": k / with_bends - 1,
            "explained_gap": k / explained - 1,
            "half_width": half_width,
        },
        convergence=convergence,
        series=(shown,),
        tables=(table,),
    )


def _law_terms(scene: Scene, length: float, rotation: float) -> dict[str, float]:
    """Friction, rotation and bends of the tube law, and the bends' effect by their curvature on rotation."""
    bore, bend = scene.tube.bore, scene.tube.bends[0]
    tube = dataclasses.replace(scene.tube, length=length * bore, bends=(bend, bend), drag_coefficient=None)
    liquid = dataclasses.replace(scene.liquid, kinematic_viscosity=VISCOSITY_M2_S)
    same = dataclasses.replace(scene, tube=tube, liquid=liquid, uncertainty=())
    loss = tube_loss(same, [REYNOLDS * VISCOSITY_M2_S / bore])
    arcs = 2 * 64 / REYNOLDS * bend.angle * bend.radius / bore
    shift = bend_shift(
        reynolds=REYNOLDS,
        rotation_reynolds=rotation,
        angle=bend.angle,
        radius=bend.radius / bore,
        with_rotation=False,
    )
    return {
        "friction": float(loss.terms["friction"][0]) + arcs,
        "rotation": loss.terms["rotation"][0],
        "bends": float(loss.terms["bends"][0]) - arcs,
        "bends_half_width": float(loss.uncertainty_parts["bends"][0]),
        "shift": 2 * shift,
    }


def _converged(scene: Scene, losses: list[float]) -> tuple[float, tuple[Convergence, ...]]:
    """Expanded uncertainty (95 %) of the finest loss, and the convergence of the losses."""
    counts = [
        (2 * around**2 + 4 * around * across) * sum(part.cells for part in path_over_crest(scene, refinement))
        for around, across, refinement in _MESHES
    ]
    sizes = [float((counts[0] / count) ** (1 / 3)) for count in counts]
    grid = gci(values=losses[::-1], sizes=sizes[::-1], formal_order=_FORMAL_ORDER, round_off=1e-9)
    study = Convergence(
        quantity="loss coefficient of the whole tube",
        unit="1",
        formal_order=_FORMAL_ORDER,
        size=sizes,
        value=losses,
        observed_order=(float(grid.observed_order),),
        gci=float(grid.uncertainty) / losses[-1],
        geometry="quadratic",
        note="size: cube root of the volume per cell",
    )
    return float(grid.uncertainty), (study,)
