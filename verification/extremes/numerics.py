"""What the numerics themselves are taken to: the cells' aspect ratio, and the step of Eq. 20's segments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.closed_form import closed_form
from ringbalance.mesh.chamber import default_cells
from ringbalance.mesh.geometry import chamber_volume, liquid_area
from ringbalance.physics.pressure.ring import ring_quantities
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.scene.models import Scene
from ringbalance.verification.extremes.axes import Axis
from ringbalance.verification.extremes.maps import Sweep, swept
from ringbalance.verification.extremes.point import ROUND_OFF, Ending, Judgement
from ringbalance.verification.reference.exact_chamber import exact_wall_pressure
from ringbalance.verification.reference.explicit_segments import explicit_segments, paper_drive

ASPECT: Final = Axis("aspect", "aspect ratio of the cells", "1", 1.0, 1e12, usual=(1.0, 1e5))
STEP: Final = Axis("step", "step of the explicit segments", "s", 1e-7, 100.0, usual=(1e-4, 0.1))
SHORTEST: Final = 1e-3
"""s, of the operation that steps are taken through; longer steps are the whole operation."""


def numerical_sweeps(scene: Scene, *, count: int, fineness: float) -> tuple[Sweep, ...]:
    """The numerics' own axes, `ASPECT` and `STEP`, as `swept`."""
    judges = {ASPECT.name: at_aspect, STEP.name: at_step}

    def judge_all(places: Sequence[tuple[Axis, float]]) -> list[Judgement]:
        return [judges[axis.name](scene, value) for axis, value in places]

    return swept((ASPECT, STEP), judge_all, count=count, fineness=fineness)


def at_aspect(scene: Scene, aspect: float) -> Judgement:
    """Wall pressure of a ring so thin that the default mesh's cells have that length over depth.

    Returns: Judgement; a ring too thin for any mesh is refused with the program's own message.
    """
    disc = scene.disc
    radial, angular = default_cells(disc=disc)
    depth = disc.outer_radius * disc.central_angle / angular / aspect * radial
    a = max(disc.outer_radius - depth, disc.inner_radius)
    fill = float(liquid_area(disc=disc, surface_radius=a)) * disc.axial_width / chamber_volume(disc=disc)
    density, omega = scene.liquid.density, abs(scene.rotor.speed)
    try:
        ring = ring_quantities(disc=disc, fill_ratio=fill, density=density, angular_velocity=omega)
    except ValueError as refused:
        return Judgement(ending=Ending.REFUSED, text=str(refused))
    exact = float(exact_wall_pressure(disc=disc, fill_ratio=fill, density=density, angular_velocity=omega))
    error = abs(float(ring.wall_pressure.value[0]) - exact)
    ratio = error / (float(ring.wall_pressure.uncertainty[0]) + ROUND_OFF * exact)
    faults = (f"an error is {ratio:.3g} times its half-width",) if ratio > 1 else ()
    return Judgement(
        ending=Ending.BROKEN if faults else Ending.SOLVED,
        text="",
        violations=faults,
        residual=ring.statistics.relative_residual,
        unknowns=float(ring.statistics.unknowns),
        worst_ratio=ratio,
    )


def at_step(scene: Scene, step: float) -> Judgement:
    """An injection under the paper's law in explicit segments of one length, against the closed form.

    The error of a segment is at most half its length times the change of the rate over it; `worst_ratio` is
    the error over that bound.
    """
    law = paper_law(scene)
    fill = scene.disc.initial_fill
    drive = paper_drive(law, gas_pressure=scene.gas.pressure, fill=fill, total=2 * fill)
    duration = max(step, SHORTEST)
    instants = np.array([duration])
    exact = closed_form(drive, instants)
    found = explicit_segments(max(1, round(duration / step)))(drive, instants)
    start = abs(float(drive.flow(drive.fill, primed=False).velocity))
    bound = drive.exchange_rate * start * step + ROUND_OFF
    error = abs(float(found.fill[-1]) - float(exact.fill[-1]))
    faults = []
    if not (drive.lowest <= found.fill[-1] <= drive.highest):
        faults.append("a fill ratio leaves its bounds")
    if error > bound:
        faults.append(f"an error of {error:.3g} is above its bound of {bound:.3g}")
    coarse = error > scene.tolerance * drive.fill
    return Judgement(
        ending=Ending.BROKEN if faults else Ending.STATUS if coarse else Ending.SOLVED,
        text="the segments' error is above the tolerance: take shorter ones" if coarse else "",
        violations=tuple(faults),
        worst_ratio=error / bound,
    )
