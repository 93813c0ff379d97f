"""Flow laws by models of their parts, and the model hierarchies of the tube's loss and of the velocity."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.chamber.closed_forms import chamber_closed_forms, chamber_pressure
from ringbalance.reduced_model.chamber.gravity import GravityEffect, closed_ring
from ringbalance.reduced_model.chamber.range import chamber_status
from ringbalance.reduced_model.chamber.terms import MEAN
from ringbalance.reduced_model.chamber.values import paper_closed_forms
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.reduced_model.selection.range_flow import (
    CONSTANT,
    LOSSES,
    SHARES,
    equal_velocity,
    loss_at,
    with_loss,
)
from ringbalance.reduced_model.selection.tube_terms import (
    CREST,
    LEVEL_STEPS,
    LOSS_STEPS,
    flow_contributions,
    loss_contributions,
)
from ringbalance.reduced_model.tables import table_from_samples
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import with_tolerance
from ringbalance.verification.reference.transfers import Integrator
from ringbalance.verification.selection_studies.hierarchy import Fidelity, ModelHierarchy, Work

EQ_12: Final = "Eq. 12"
CLOSED: Final = "closed form"
QUADRATURE: Final = "quadrature, gravity to all orders"
SIPHON: Final = "always a full siphon"
REGIMES: Final = "four regimes over the siphon crest"
LEVELS: Final = {EQ_12: 4, CLOSED: 30, QUADRATURE: 200}
"""Models of a chamber's level with their counted formulas at one fill, in order of increasing cost."""
_FORMULAS: Final = dict(zip(LOSSES, (1, 20, 60, 260), strict=True))
"""Counted formulas of a loss at one velocity; the look-ups of tables among them."""
_LEVEL_NODES: Final = 21
_STEPS: Final = ((tuple(LEVELS), LEVEL_STEPS), (LOSSES, tuple(LOSS_STEPS)), ((SIPHON, REGIMES), (CREST,)))
"""Models of each part of a law, and the term that each model after the first adds."""
_VELOCITY_FACTORS: Final = (0.25, 0.5, 1.0, 2.0)
"""Velocities at which k is judged, over the one estimated at equal fills."""


class LawModels(NamedTuple):
    """Which models a flow law is made of."""

    level: str
    """One of `LEVELS`."""
    loss: str
    """One of `LOSSES`."""
    regimes: str
    """`SIPHON` or `REGIMES`."""


class Course(NamedTuple):
    """How an injection is carried through time, or none, where the law itself is asked."""

    name: str = ""
    lacks: tuple[str, ...] = ()
    work: Work = {"law": 1.0}  # noqa: RUF012 - a mapping that nobody changes
    """For one point of a hierarchy."""
    integrator: Integrator | None = None
    """By the flow law alone; None: the march."""
    modelled: tuple[str, ...] = ()
    """Terms of an injection that the plant carries."""


class LawBook:
    """Laws of one scene by their models, each made once."""

    def __init__(self, scene: Scene) -> None:
        """Start with the law by the finest models but without gravity, whose parts are exchanged."""
        self.scene = scene
        still = replace(scene, environment=replace(scene.environment, gravity=0.0))
        self.base = calibrate(with_tolerance(still, models="finest")).flow_law
        self._made: dict[LawModels, CalibratedLaw] = {}

    def models(self) -> tuple[LawModels, ...]:
        """Every level with every loss, without the crest's regimes and, where there is a crest, with them."""
        regimes = (SIPHON, REGIMES) if self._crest else (SIPHON,)
        losses = LOSSES if self.scene.tube.drag_coefficient is None else (CONSTANT,)
        levels = tuple(LEVELS) if self._tilts() else (EQ_12, CLOSED)
        return tuple(
            LawModels(level, loss, regime) for level in levels for loss in losses for regime in regimes
        )

    def law(self, models: LawModels) -> CalibratedLaw:
        """The law of some models; half-widths are those of the base law."""
        if models not in self._made:
            self._made[models] = self.make(models)
        return self._made[models]

    def make(self, models: LawModels) -> CalibratedLaw:
        """Make a law, again if need be, so that its making can be timed."""
        base, made = self.base, TubeHeads.exact(with_loss(self.scene, models.loss))
        pressure, moment = self._levels(models.level)
        heads = replace(
            base.heads, head=made.head, hump_head=made.hump_head, return_hump_head=made.return_hump_head
        )
        law = replace(
            base,
            name="; ".join(models),
            hydrostatic_pressure=table_from_samples(start=0.0, stop=base.max_fill_ratio, value=pressure),
            moment=replace(
                base.moment,
                chamber_moment=table_from_samples(start=0.0, stop=base.max_fill_ratio, value=moment),
            ),
            heads=heads,
        )
        if models.level == EQ_12:
            law = replace(law, chamber_volume=paper_law(self.scene).chamber_volume)
        if models.regimes == REGIMES:
            return law
        return replace(
            law,
            path=replace(law.path, hump_pressure=None),
            heads=replace(heads, hump_head=None, return_hump_head=None),
        )

    def _levels(self, level: str) -> tuple[FloatArray, FloatArray]:
        """Pressure at R2, Pa, and moment, kg m, at even fills.

        The paper's moment is lambda times half its mass: only differences of two chambers count. Below the
        thinnest closed ring gravity's change fades in proportion to the fill.
        """
        scene, fills = self.scene, np.linspace(0.0, self.base.max_fill_ratio, _LEVEL_NODES)
        _, moment, _ = chamber_closed_forms(scene=scene, fill_ratio=fills)
        pressure = chamber_pressure(scene=scene, fill_ratio=fills)
        if level == EQ_12:
            pressure, _ = paper_closed_forms(scene, fills)
            moment = paper_law(scene).moment.pair_moment(fill_ratio=fills, opposite_fill_ratio=0.0)
        if level == QUADRATURE:
            effect, closed = GravityEffect.of(scene, fill_ratio=fills), closed_ring(scene, fills)
            changes = effect.hydrostatic_pressure, effect.moment
            pressure, moment = (
                value + np.interp(fills, fills[closed], change[closed])
                for value, change in zip((pressure, moment), changes, strict=True)
            )
        return pressure, scene.disc.moment_factor * moment

    def _tilts(self) -> bool:
        """Whether there is gravity, and it leaves the ring closed at the fills at which flow is judged."""
        fills = self.scene.disc.max_fill_ratio * np.array(SHARES)
        return self.scene.environment.gravity > 0 and bool(np.all(closed_ring(self.scene, fills)))

    @property
    def _crest(self) -> bool:
        return self.scene.tube.hump_radius is not None

    def uncertainty(self) -> float:
        """Relative half-width of the base law's velocity at equal fills; zero where nothing flows.

        It holds gravity's contribution where no model of this scene does.
        """
        scene, missing = self.scene, 0.0
        if not self._tilts():
            missing = flow_contributions(scene)[MEAN].value or 0.0
        x = scene.disc.max_fill_ratio / 2
        flow = self.base.evaluate(
            fill_ratio=x, opposite_fill_ratio=x, gas_pressure=scene.gas.pressure, primed=True
        )
        speed = abs(float(flow.velocity))
        return math.hypot(float(flow.uncertainty) / speed if speed else 0.0, missing)

    def fidelity(
        self, models: LawModels, solve: Callable[[int], FloatArray], course: Course | None = None
    ) -> Fidelity:
        """Models of what a law decides on; `course`: of what it decides over time."""
        way = course or Course()
        short = [models.loss, models.level]
        if self._crest:
            short.append("hump" if models.regimes == REGIMES else "no hump")
        parts = {
            "level of a chamber": models.level,
            "loss of the tube": models.loss,
            "flow over the siphon crest": models.regimes,
        }
        if course is not None:
            short, parts = [*short, course.name], {**parts, "operation in time": course.name}
        tables = 3 if models.regimes == REGIMES else 1
        counted = {
            "formula": float(_LEVEL_NODES * LEVELS[models.level]),
            "table": float(tables * _FORMULAS[models.loss]),
        }
        return Fidelity(
            name="; ".join(short),
            models=parts,
            leaves_out=self._lacks(models) | frozenset(way.lacks),
            work=way.work,
            fixed_work=counted,
            solve=solve,
            prepare=partial(self.make, models),
        )

    def _lacks(self, models: LawModels) -> frozenset[str]:
        chosen = zip(models, _STEPS, strict=True)
        lacking = {term for model, (every, adds) in chosen for term in adds[every.index(model) :]}
        return frozenset(lacking if self._crest else lacking - {CREST})


def k_hierarchy(scene: Scene) -> ModelHierarchy:
    """The model hierarchy of the tube's loss, as k + 1, which is what heads know."""
    velocities = (equal_velocity(scene) or 1.0) * np.array(_VELOCITY_FACTORS)
    finest = tube_loss(scene, velocities).k

    def solve(point: int, *, loss: str) -> FloatArray:
        return np.array([float(loss_at(scene, loss=loss, velocity=velocities[point]).k) + 1])

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
                leaves_out=frozenset(tuple(LOSS_STEPS)[i:]),
                work={"formula": float(_FORMULAS[loss])},
                solve=partial(solve, loss=loss),
            )
            for i, loss in enumerate(LOSSES)
        ),
        top_uncertainty=float(np.max(finest.uncertainty / (finest.value + 1))),
        top_uncertainty_from="correlations, tables, roughness and viscosity, as `calibrate` has them",
    )


def velocity_hierarchy(book: LawBook) -> ModelHierarchy:
    """The model hierarchy of the velocity over the fills, from an empty tube under the scene's pressure."""
    scene, largest = book.scene, book.scene.disc.max_fill_ratio
    fills = largest * np.array(SHARES)

    def solve(point: int, *, models: LawModels) -> FloatArray:
        x, pressure = fills[point], scene.gas.pressure
        flow = book.law(models).evaluate(fill_ratio=x, opposite_fill_ratio=largest - x, gas_pressure=pressure)
        return np.array([float(flow.velocity)])

    return ModelHierarchy(
        quantity="velocity",
        title="velocity in the tube",
        values=("m/s, out of the driven chamber",),
        points=tuple(f"fill ratio {x:.3g}" for x in fills),
        check=(0, 2, 4),
        relative_to="largest",
        contributions=flow_contributions(scene),
        fidelities=tuple(book.fidelity(m, partial(solve, models=m)) for m in book.models()),
        top_uncertainty=book.uncertainty(),
        top_uncertainty_from="half of k's, and what drives the flow, as `calibrate` has them",
        status=chamber_status(scene),
    )
