"""Flow laws by models: any level of the chambers, any loss of the tube, with the crest's regimes or
without."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.chamber.gravity import closed_ring
from ringbalance.reduced_model.chamber.values import by_closed_form, by_paper, by_quadrature
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.reduced_model.paper import formulas as paper
from ringbalance.reduced_model.selection.loss_models import FORMULAS, head_at
from ringbalance.reduced_model.tables.fit import refined_table, table_from_samples
from ringbalance.reduced_model.tables.hermite import HermiteTable
from ringbalance.reduced_model.tube.heads import TABLE_ERROR, TABLE_VELOCITIES, TubeHeads
from ringbalance.scene.accuracy import with_tolerance
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene, Tube
from ringbalance.verification.selection_studies.hierarchy import Work

EQ_12: Final = "Eq. 12"
CLOSED: Final = "closed form"
QUADRATURE: Final = "quadrature, gravity to all orders"
LEVELS: Final = (EQ_12, CLOSED, QUADRATURE)
"""In order of increasing cost."""
SIPHON: Final = "always a full siphon"
REGIMES: Final = "four regimes over the siphon crest"
LEVEL_NODES: Final = 21
_AT: Final = {EQ_12: by_paper, CLOSED: by_closed_form, QUADRATURE: by_quadrature}
_LEVEL_FORMULAS: Final = {EQ_12: 4, CLOSED: 30, QUADRATURE: 200}


@dataclass(frozen=True, kw_only=True)
class LawModels:
    """Which models a flow law is made of."""

    level: str
    """One of `LEVELS`."""
    loss: str
    """One of `LOSSES`."""
    regimes: str
    """`SIPHON` or `REGIMES`."""

    def named(self) -> Mapping[str, str]:
        """Model of each part, for people."""
        return {
            "level of a chamber": self.level,
            "loss of the tube": self.loss,
            "flow over the siphon crest": self.regimes,
        }

    def work(self, scene: Scene) -> Work:
        """Counted work of making a law: formulas at the nodes of its tables. Returns: Counts by kind."""
        tables = 3 if scene.tube.hump_radius is not None and self.regimes == REGIMES else 1
        level = LEVEL_NODES * _LEVEL_FORMULAS[self.level]
        return {"formula": float(level), "table": float(tables * FORMULAS[self.loss])}

    def law(self, scene: Scene, *, base: CalibratedLaw) -> CalibratedLaw:
        """The base law with its level, moment, loss and regimes exchanged, but for its half-widths."""
        pressure, moment = _level_tables(scene, self.level)
        path, heads = base.path, _loss_heads(scene, self.loss, base=base.heads)
        if self.regimes == SIPHON:
            path = replace(path, hump_pressure=None)
            heads = replace(heads, hump_head=None, return_hump_head=None)
        volume = base.chamber_volume
        if self.level == EQ_12:
            volume = paper.chamber_volume_paper(disc=scene.disc)
        return replace(
            base,
            name=f"{self.level}; {self.loss}; {self.regimes}",
            wall_pressure=pressure,
            moment=replace(base.moment, chamber_moment=moment),
            path=path,
            heads=heads,
            chamber_volume=volume,
        )


def base_law(scene: Scene) -> CalibratedLaw:
    """The scene's law by the finest models but without gravity, whose parts are exchanged; a ring exists."""
    still = replace(scene, environment=replace(scene.environment, gravity=0.0))
    return calibrate(with_tolerance(still, models="finest")).flow_law


def levels_available(scene: Scene) -> tuple[str, ...]:
    """Models of the level: without gravity alone where there is none, or where it opens some ring."""
    gravity = scene.environment.gravity
    if gravity == 0:
        return LEVELS[:2]
    fills = scene.disc.max_fill_ratio * np.linspace(0, 1, LEVEL_NODES)[1:]
    closed = closed_ring(scene, fills)
    # The thinnest film is open under any gravity; what counts is where the chamber works.
    return LEVELS if bool(np.all(closed[2:])) else LEVELS[:2]


def _level_tables(scene: Scene, level: str) -> tuple[HermiteTable, HermiteTable]:
    """Wall pressure, Pa, and moment, kg m, over the fill by one model; an empty chamber has neither.

    The paper's moment is lambda times half its mass: only differences of two chambers count.
    """
    largest = scene.disc.max_fill_ratio
    fills = np.linspace(0.0, largest, LEVEL_NODES)
    values = [_AT[level](scene, float(x)) for x in fills[1:]]
    pressure = np.array([0.0, *(v.wall_pressure for v in values)])
    moment = np.array([0.0, *(v.moment for v in values)])
    if level == EQ_12:
        law = paper_law(scene).moment
        half = law.density * law.chamber_volume / 2
        moment = law.moment_per_transferred_mass * half * fills
    if level == QUADRATURE:
        pressure, moment = _thin_film(scene, fills, pressure), _thin_film(scene, fills, moment, moment=True)
    return (
        table_from_samples(start=0.0, stop=largest, value=pressure),
        table_from_samples(start=0.0, stop=largest, value=scene.disc.moment_factor * moment),
    )


def _thin_film(scene: Scene, fills: FloatArray, values: FloatArray, *, moment: bool = False) -> FloatArray:
    """Below the thinnest closed ring gravity's change fades in proportion to the fill."""
    closed = closed_ring(scene, fills)
    if np.all(closed):
        return values
    first = int(np.max(np.flatnonzero(~closed))) + 1
    plain = [by_closed_form(scene, float(x)) for x in fills[1 : first + 1]]
    without = np.array([0.0, *(v.moment if moment else v.wall_pressure for v in plain)])
    change = values[first] - without[first]
    held = values.copy()
    held[:first] = without[:first] + change * fills[:first] / fills[first]
    return held


def _loss_heads(scene: Scene, loss: str, *, base: TubeHeads) -> TubeHeads:
    """Heads of the tube by one model of the loss, with the half-widths of `base`."""
    returning = replace(scene.tube, hump_position=1 - scene.tube.hump_position, bends=scene.tube.bends[::-1])
    head = _table(scene, scene.tube, loss, hump=False)
    if base.hump_head is None:
        return replace(base, head=head)
    return replace(
        base,
        head=head,
        hump_head=_table(scene, scene.tube, loss, hump=True),
        return_hump_head=_table(scene, returning, loss, hump=True),
    )


def _table(scene: Scene, tube: Tube, loss: str, *, hump: bool) -> HermiteTable:
    def log_head(log_velocity: FloatArray) -> FloatArray:
        head = head_at(scene, loss=loss, velocity=np.exp(log_velocity), to_crest=hump, tube=tube)
        return np.asarray(np.log(head), dtype=np.float64)

    start, stop = (float(v) for v in np.log(TABLE_VELOCITIES))
    return refined_table(function=log_head, start=start, stop=stop, tolerance=TABLE_ERROR)[0]
