"""The model hierarchies of the tube: k, and the velocity for given fills and gas pressure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.chamber.range import chamber_status
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.selection.loss_models import (
    CONSTANT,
    CORRELATIONS,
    FORMULAS,
    LOSSES,
    ROTATING,
    TABLES,
    loss_at,
)
from ringbalance.reduced_model.selection.range_flow import SHARES, equal_velocity
from ringbalance.reduced_model.selection.tube_terms import (
    GRAVITY,
    HUMP,
    LEVEL,
    LOSS,
    ROTATION,
    TABLE,
    flow_contributions,
    loss_contributions,
)
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy
from ringbalance.verification.selection_studies.law_models import (
    CLOSED,
    EQ_12,
    QUADRATURE,
    REGIMES,
    SIPHON,
    LawModels,
    levels_available,
)

VELOCITY_FACTORS: Final = (0.25, 0.5, 1.0, 2.0)
"""Velocities at which k is judged, over the one estimated at equal fills."""
LACKS_LOSS: Final[Mapping[str, tuple[str, ...]]] = {
    CONSTANT: (LOSS, ROTATION, TABLE),
    CORRELATIONS: (ROTATION, TABLE),
    ROTATING: (TABLE,),
    TABLES: (),
}
LACKS_LEVEL: Final[Mapping[str, tuple[str, ...]]] = {
    EQ_12: (LEVEL, GRAVITY),
    CLOSED: (GRAVITY,),
    QUADRATURE: (),
}


class LawBook:
    """Laws of one scene by their models, each made once."""

    def __init__(self, scene: Scene, base: CalibratedLaw) -> None:
        """Start with no law made."""
        self.scene = scene
        self.base = base
        self._made: dict[LawModels, CalibratedLaw] = {}

    def law(self, models: LawModels) -> CalibratedLaw:
        """The law of some models."""
        if models not in self._made:
            self._made[models] = models.law(self.scene, base=self.base)
        return self._made[models]

    def make(self, models: LawModels) -> CalibratedLaw:
        """Make a law again, so that its making can be timed."""
        self._made.pop(models, None)
        return self.law(models)


def k_hierarchy(scene: Scene) -> ModelHierarchy:
    """The model hierarchy of the tube's loss, as k + 1, which is what heads know."""
    centre = equal_velocity(scene) or 1.0
    velocities = centre * np.array(VELOCITY_FACTORS)

    def solve(point: int, *, loss: str) -> FloatArray:
        return np.array([float(loss_at(scene, loss=loss, velocity=velocities[point]).k) + 1])

    width = _k_uncertainty(scene, velocities)
    return ModelHierarchy(
        quantity="k",
        title="k",
        values=("k + 1",),
        points=tuple(f"{u:.3g} m/s" for u in velocities),
        check=(0, 2, 3),
        relative_to="each",
        contributions=loss_contributions(scene),
        fidelities=tuple(
            Fidelity(
                name=loss,
                models={"loss of the tube": loss},
                leaves_out=frozenset(LACKS_LOSS[loss]),
                work={"formula": float(FORMULAS[loss])},
                solve=partial(solve, loss=loss),
            )
            for loss in LOSSES
        ),
        top_uncertainty=width,
        top_uncertainty_from="correlations, tables, roughness and viscosity, as `calibrate` has them",
    )


def _k_uncertainty(scene: Scene, velocities: FloatArray) -> float:
    found = tube_loss(scene, velocities)
    return float(np.max(found.k.uncertainty / (found.k.value + 1)))


def flow_models(scene: Scene) -> tuple[LawModels, ...]:
    """Every level with every loss, without the crest's regimes and, where there is a crest, with them."""
    regimes = (SIPHON, REGIMES) if scene.tube.hump_radius is not None else (SIPHON,)
    losses = LOSSES if scene.tube.drag_coefficient is None else (CONSTANT,)
    return tuple(
        LawModels(level=level, loss=loss, regimes=regime)
        for level in levels_available(scene)
        for loss in losses
        for regime in regimes
    )


def lacks(models: LawModels, *, hump: bool) -> frozenset[str]:
    """Names of the contributions that a law leaves out on a scene with a crest or without."""
    separated = (HUMP,) if hump and models.regimes == SIPHON else ()
    return frozenset((*LACKS_LEVEL[models.level], *LACKS_LOSS[models.loss], *separated))


def velocity_hierarchy(scene: Scene, *, book: LawBook) -> ModelHierarchy:
    """The model hierarchy of the velocity over the fills, from an empty tube under the scene's pressure."""
    largest, pressure = scene.disc.max_fill_ratio, scene.gas.pressure
    fills = largest * np.array(SHARES)

    def solve(point: int, *, models: LawModels) -> FloatArray:
        x = fills[point]
        flow = book.law(models).evaluate(fill_ratio=x, opposite_fill_ratio=largest - x, gas_pressure=pressure)
        return np.array([float(flow.velocity)])

    hump = scene.tube.hump_radius is not None
    return ModelHierarchy(
        quantity="velocity",
        title="velocity in the tube",
        values=("m/s, out of the driven chamber",),
        points=tuple(f"fill ratio {x:.3g}" for x in fills),
        check=(0, 2, 4),
        relative_to="largest",
        contributions=flow_contributions(scene),
        fidelities=tuple(
            Fidelity(
                name=law_name(models, hump=hump),
                models=models.named(),
                leaves_out=lacks(models, hump=hump),
                work={"law": 1.0},
                fixed_work=models.work(scene),
                solve=partial(solve, models=models),
                prepare=partial(book.make, models),
            )
            for models in flow_models(scene)
        ),
        top_uncertainty=velocity_uncertainty(scene, book),
        top_uncertainty_from="half of k's, and what drives the flow, as `calibrate` has them",
        status=chamber_status(scene),
    )


def law_name(models: LawModels, *, hump: bool) -> str:
    """Short name of a law's models."""
    parts = [models.loss, models.level]
    if hump:
        parts.append("hump" if models.regimes == REGIMES else "no hump")
    return "; ".join(parts)


def velocity_uncertainty(scene: Scene, book: LawBook) -> float:
    """Relative half-width of the base law's velocity at equal fills; zero where nothing flows.

    It holds gravity's contribution where no model of this scene does.
    """
    missing = 0.0
    if QUADRATURE not in levels_available(scene):
        missing = flow_contributions(scene)[GRAVITY].value or 0.0
    x = scene.disc.max_fill_ratio / 2
    flow = book.base.evaluate(
        fill_ratio=x, opposite_fill_ratio=x, gas_pressure=scene.gas.pressure, primed=True
    )
    speed = abs(float(flow.velocity))
    return math.hypot(float(flow.uncertainty) / speed if speed else 0.0, missing)
