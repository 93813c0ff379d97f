"""What a fit's residuals say of its laws: whether they describe the data, and which others would not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.identification.criticism.explained import Explained, shares_explained
from ringbalance.identification.criticism.law_comparison import LawComparison
from ringbalance.identification.criticism.ranges import ComparedColumn, compared_columns
from ringbalance.identification.criticism.readings import Reading, other_readings
from ringbalance.identification.criticism.residual_tests import Criticism, LinearFit
from ringbalance.identification.device import Device
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.likelihood import Block, Problem
from ringbalance.identification.result import FitResult
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tables import HermiteTable, table_from_samples
from ringbalance.scene.arrays import FloatArray, StringArray
from ringbalance.scene.models import Scene
from ringbalance.scene.paths import with_values_at

_BY_LAW: Final = ("injection", "transfer", "flow")
"""Kinds that the law of the tube's flow decides on."""
LAMINAR: Final = "laminar flow (a loss in proportion to the velocity)"
TURBULENT: Final = "turbulent flow (a loss in proportion to its square)"
UNBROKEN: Final = "a column that never separates over the crest"
BROKEN: Final = "a column that separates at ambient pressure"
UNSPILT: Final = "a column that runs full without spilling first"
EXPONENTS: Final[Mapping[str, float]] = MappingProxyType({LAMINAR: 1.0, TURBULENT: 2.0})
"""Of the loss over the velocity, of those of these laws that are powers."""
_OF_THE_CREST: Final = (UNBROKEN, BROKEN, UNSPILT)

WITHOUT: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = MappingProxyType(
    {
        "a rotor without damping": ("run_up", ("rotor.damping",)),
        "masses without friction": ("positioning", ("masses.friction_arm[0]", "masses.friction_arm[1]")),
        "a motor without back EMF": ("positioning", ("motor.back_emf_constant",)),
    }
)
"""Of eccentric masses: the kind of data that an effect moves, and the values that are zero without it."""


@dataclass(frozen=True, kw_only=True)
class Review:
    """Criticism of a fit."""

    criticism: Criticism
    laws: tuple[LawComparison, ...]
    """The fitted law against others; empty where no data depend on one."""
    explained: tuple[Explained, ...] = ()
    """Of each file, what the fit explains of it."""
    readings: tuple[Reading, ...] = ()
    """Other readings of the files, the likeliest first."""
    ranges: tuple[ComparedColumn, ...] = ()
    """Columns against what the scene has."""

    @property
    def _read_wrongly(self) -> tuple[str, ...]:
        """What speaks against the files as they stand, each in one sentence."""
        named = [each.text for each in self.readings if each.named]
        unexplained = [each.text for each in self.explained if each.fails]
        return (*named, *unexplained, *(each.text for each in self.ranges if each.fails))

    @property
    def describes(self) -> bool:
        """Whether the fit describes the data, as they are read."""
        return self.criticism.describes and not self._read_wrongly

    @property
    def holds(self) -> bool:
        """Whether the fit describes the data, and no other law does so better."""
        return self.describes and all(each.outcome != "other" for each in self.laws)

    @property
    def text(self) -> str:
        """The verdict on the fit; sound residuals say nothing of data that are read wrongly."""
        if not self._read_wrongly:
            return self.criticism.text
        residuals = [] if self.criticism.describes else [self.criticism.text]
        return "the fit does not describe the data as they are read: " + "; ".join(
            [*self._read_wrongly, *residuals]
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """All that is to be said, the verdict on the fit first."""
        return (self.text, *(each.text for each in self.laws))

    @classmethod
    def of(cls, result: FitResult) -> Review:
        """Test the residuals of a fit, read its data otherwise, and compare its law with others."""
        found, best = _at_solution(result), result.optimum
        ranges = compared_columns(best.residuals.problem)
        return cls(
            criticism=Criticism.of(found.fit),
            laws=tuple(_comparisons(result, found)),
            explained=shares_explained(best),
            readings=other_readings(best, ranges),
            ranges=ranges,
        )


def _comparisons(result: FitResult, found: _AtSolution) -> Iterator[LawComparison]:
    best = result.optimum
    problem, scene = best.residuals.problem, best.residuals.problem.scene_at(best.t)
    # Each yields nothing without data of the kinds that it is about.
    for name, predicted in (*_by_other_tubes(problem, scene), *_by_other_machines(problem, scene)):
        residuals = found.turned(best.residuals.at(best.t, predicted=predicted))
        yield LawComparison.of(found.fit, other=name, residuals=residuals)


def _by_other_machines(problem: Problem, scene: EccentricScene) -> Iterator[tuple[str, FloatArray]]:
    """Without one of the effects that move the data, unless its size is fitted: then its interval tells."""
    fitted = {parameter.name for parameter in problem.parameters}
    kinds = {block.observations.kind for block in problem.blocks}
    for name, (kind, paths) in WITHOUT.items():
        if kind in kinds and not fitted & set(paths):
            yield name, problem.predicted(with_values_at(scene, dict.fromkeys(paths, 0.0)))


def _by_other_tubes(problem: Problem, scene: Scene) -> Iterator[tuple[str, FloatArray]]:
    """By other laws of the tube's flow, where data depend on it."""
    blocks = [b for b in problem.blocks if b.observations.kind in _BY_LAW]
    if not blocks:
        return
    law, velocity = Device.of(scene, problem.models).law, _typical_velocity(scene, problem, blocks)
    for name in _laws_to_compare(law):
        models = replace(problem.models, other=partial(_other_law, name=name, velocity=velocity))
        other = replace(problem, models=models)
        yield (
            name,
            np.concatenate(
                [b.whiten @ _predicted(b, scene, other, EXPONENTS.get(name)) for b in problem.blocks]
            ),
        )


def _predicted(block: Block, scene: Scene, problem: Problem, exponent: float | None) -> FloatArray:
    """By the other law; flow at rest follows a power of the pressure through its middle value."""
    own = block.predicted(scene, problem.models)
    if block.observations.kind != "flow" or exponent is None:
        return own
    pressure = block.observations.columns["pressure_difference"]
    middle = int(np.argsort(pressure)[pressure.size // 2])
    return np.asarray(own[middle] * (pressure / pressure[middle]) ** (1 / exponent))


def _typical_velocity(scene: Scene, problem: Problem, blocks: list[Block]) -> float:
    """At equal fills under the middle of the data's gas pressures, m/s; 1 where nothing flows there."""
    pressures = [b.observations.columns["pressure"] for b in blocks if "pressure" in b.observations.columns]
    pressure = float(np.median(np.concatenate(pressures))) if pressures else scene.gas.pressure
    law, x = Device.of(scene, problem.models).law, scene.disc.initial_fill
    flow = law.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure, primed=True)
    return abs(float(flow.velocity)) or 1.0


def _power_of(law: CalibratedLaw, velocity: float, exponent: float) -> CalibratedLaw:
    """Heads in proportion to a power of the velocity, those of the law at one velocity, m/s."""
    heads = law.heads
    near, far = heads.hump_head, heads.return_hump_head
    return replace(
        law,
        heads=replace(
            heads,
            head=_straight(heads.head, velocity, exponent),
            hump_head=None if near is None else _straight(near, velocity, exponent),
            return_hump_head=None if far is None else _straight(far, velocity, exponent),
        ),
    )


def _straight(table: HermiteTable, velocity: float, exponent: float) -> HermiteTable:
    nodes: FloatArray = table.nodes
    at = float(np.clip(np.log(velocity), nodes[0], nodes[-1]))
    value = table(at) + exponent * (nodes - at)
    return table_from_samples(start=float(nodes[0]), stop=float(nodes[-1]), value=value)


def _other_law(law: CalibratedLaw, *, name: str, velocity: float) -> CalibratedLaw:
    """The other law of a name, from the fitted one; a power has the same loss at a velocity, m/s."""
    if name in EXPONENTS:
        return _power_of(law, velocity, EXPONENTS[name])
    if name == UNBROKEN:
        heads = replace(law.heads, hump_head=None, return_hump_head=None)
        return replace(law, path=replace(law.path, hump_pressure=None), heads=heads)
    if name == BROKEN:
        return replace(law, path=replace(law.path, vapour_pressure=0.0, released=0.0))
    if name == UNSPILT:
        return replace(law, path=replace(law.path, froude_velocity=0.0))
    raise ValueError(f"{name!r} is no other law")


def _laws_to_compare(law: CalibratedLaw) -> tuple[str, ...]:
    """Names of those that mean something for a law: a tube without crest has no column to break."""
    return (*EXPONENTS, *(() if law.path.hump_pressure is None else _OF_THE_CREST))


@dataclass(frozen=True, kw_only=True, eq=False)
class _AtSolution:
    """Rows are those of all files, then held inputs, then priors."""

    fit: LinearFit
    """Of a vibration the part along its predicted change, and the part across."""
    turn: FloatArray
    """Rotation of the rows of vibrations into these parts, shape (measured, measured)."""

    def turned(self, rows: FloatArray) -> FloatArray:
        """Rows of the fit's own order, with those of vibrations along and across."""
        count = self.turn.shape[0]
        return np.concatenate([self.turn @ rows[:count], rows[count:]])


def _at_solution(result: FitResult) -> _AtSolution:
    """The fit linearised at its optimum; what is no parameter but was fitted too counts as one."""
    best = result.optimum
    problem, residuals = best.residuals.problem, best.residuals
    count, parts = problem.measured.size, best.at
    turn = _rotation(result)
    more = np.zeros((parts.size - residuals.base.shape[0], residuals.base.shape[1]))
    whole = np.hstack([-best.slopes, np.concatenate([residuals.base, more])])
    data = np.arange(parts.size) < count
    known = np.zeros(parts.size, dtype=np.bool_)
    known[:count] = problem.group < 0
    blocks = np.concatenate([_titles(b.observations, b.measured.size) for b in problem.blocks])
    rest = np.full(parts.size - count, "beforehand")
    return _AtSolution(
        fit=LinearFit(
            residuals=np.concatenate([turn @ parts[:count], parts[count:]]),
            derivatives=np.concatenate([turn @ whole[:count], whole[count:]]),
            block=np.concatenate([blocks, rest]),
            data=data,
            known_noise=known,
            order=_order(problem, parts.size),
        ),
        turn=turn,
    )


def _titles(observations: Observations, size: int) -> StringArray:
    title = Path(observations.file).name
    if size == len(observations):
        return np.full(size, title)
    parts = ("along the predicted change", "across the predicted change")
    return np.repeat([f"{title} {part}" for part in parts], len(observations))


def _rotation(result: FitResult) -> FloatArray:
    """Rotates a vibration's real and imaginary part into those along its predicted change and across."""
    problem, t = result.optimum.residuals.problem, result.optimum.t
    predicted, turn = problem.at(t), np.eye(problem.measured.size)
    for block, mine in problem.rows:
        rows = len(block.observations)
        if block.measured.size == 2 * rows:
            along = block.observations.rows_of(predicted[mine])
            angle = np.arctan2(along[:, 1], along[:, 0])
            i = mine.start + np.arange(rows)
            turn[i, i] = turn[i + rows, i + rows] = np.cos(angle)
            turn[i, i + rows], turn[i + rows, i] = np.sin(angle), -np.sin(angle)
    return turn


def _order(problem: Problem, size: int) -> FloatArray:
    """Row of its file that each residual is of; the two parts of a vibration have one."""
    order = np.zeros(size)
    for block, mine in problem.rows:
        order[mine] = np.resize(np.arange(float(len(block.observations))), block.measured.size)
    return order
