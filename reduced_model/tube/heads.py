"""The tube's loss as tables of head against velocity, which a flow law can invert in microseconds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import (
    corrected_state,
    model_parts,
    uncertainty_parts,
    unfitted_parts,
    with_errors,
)
from ringbalance.physics.tube.state import TubeState, tube_state
from ringbalance.reduced_model.tables import HermiteTable, flat_table, level_table, tables_from_samples
from ringbalance.reduced_model.tube.path import (
    crest_end_uncertainty,
    crest_span,
    head_behind_crest,
    reversed_tube,
)
from ringbalance.scene.arrays import BoolArray, FloatArray, plain
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.designs import Designs
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene, Tube
from ringbalance.scene.toml import toml_text
from ringbalance.scene.uncertain import independent_half_widths

TABLE_VELOCITIES: Final = (1e-5, 1e3)
"""m/s; below, the flow creeps and the head is proportional to u; above, to a power of u."""
_NODES: Final = 2049
"""Of a table; more sharpen nothing but the bend where the flow turns turbulent."""
_NOMINAL_NODES: Final = 257
_UNCERTAINTY_NODES: Final = 513
_LEVELLED: Final = 0.05
"""Of ln of a head: a few percent, a fraction of what such errors change it by."""
_RISE: Final = 1e-9
"""Of ln of a head over ln u, below what tables resolve."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TubeHeads:
    """Heads of the full tube over ln u (u in m/s), natural logarithms of m^2/s^2."""

    head: HermiteTable
    """ln((k + 1) u^2/2): between the chambers."""
    hump_head: HermiteTable | None
    """ln((alpha + k_up) u^2/2): from the driven chamber to the lowest pressure on the path, at the end of the
    crest's arc or just behind it; None without a crest."""
    return_hump_head: HermiteTable | None
    """The same from the opposite chamber, for reverse flow."""
    uncertainty: HermiteTable
    """Expanded uncertainty (95 %) of k over k + 1."""
    hump_uncertainty: HermiteTable
    """Expanded uncertainty (95 %) of k_up over alpha + k_up, with the place of the crest's end."""
    fraction_uncertainty: HermiteTable
    """Expanded uncertainty (95 %) of (alpha + k_up)/(k + 1)."""
    interpolation_error: float = 0.0
    """Largest relative error of the head tables found between their nodes; zero where none was looked for."""

    @classmethod
    def nominal(cls, designs: Designs) -> tuple[TubeHeads, ...]:
        """The heads of every design without uncertainties and on few nodes.

        These do not depend on the scene: their error, below 1e-4 of a head, is smooth in its values.
        Raises: ValueError: as `TubeHeads.of`. SceneError: the scene's `model_errors` make no loss.
        """
        return cls._tabled(designs.scene, _sampled(designs.scene, _NOMINAL_NODES))

    @classmethod
    def _tabled(cls, scene: Scene, values: list[FloatArray]) -> tuple[TubeHeads, ...]:
        """From `log_heads` over the velocities, shape (nodes, designs)."""
        if not all(np.all(np.diff(value, axis=0) > 0) for value in values):
            raise _inconsistent(scene)
        start, stop = (float(v) for v in np.log(TABLE_VELOCITIES))
        exact = flat_table(start=start, stop=stop)
        tables = [tables_from_samples(start=start, stop=stop, value=value) for value in values]
        return tuple(
            cls(
                head=between,
                hump_head=to_crest[0] if to_crest else None,
                return_hump_head=to_crest[1] if to_crest else None,
                uncertainty=exact,
                hump_uncertainty=exact,
                fraction_uncertainty=exact,
            )
            for between, *to_crest in zip(*tables, strict=True)
        )

    @classmethod
    def bare(cls, scene: Scene) -> TubeHeads:
        """The same heads as `of`, without their uncertainties: a fraction of its work. Raises: as `of`."""
        return cls._tabled(scene, _sampled(scene, _NODES))[0]

    @classmethod
    def of(cls, scene: Scene) -> TubeHeads:
        """Tabulate the heads of a scene's tube.

        Raises: ValueError: arcs of bends longer than the tube.
        Source: definition of k; the crest's energy balance with the profile's kinetic-energy factor alpha.
        """
        place = crest_end_uncertainty(scene.tube, independent_half_widths(scene).get("hump_position", 0.0))
        start, stop = np.log(TABLE_VELOCITIES)
        widths = _widths(scene, np.linspace(start, stop, _UNCERTAINTY_NODES), place=place)
        places, values = np.linspace(start, stop, 2 * _NODES - 1), _sampled(scene, 2 * _NODES - 1)
        heads = cls._tabled(scene, [value[::2] for value in values])[0]
        tables = (heads.head, heads.hump_head, heads.return_hump_head)
        missed = [
            np.max(np.abs(table(places) - value[:, 0]))
            for table, value in zip(tables, values, strict=False)
            if table is not None
        ]
        return replace(heads, interpolation_error=float(max(missed)), **widths)

    def to_crest(self, *, reverse: bool) -> HermiteTable | None:
        """From the chamber that gives liquid; None without a crest."""
        return self.return_hump_head if reverse else self.hump_head

    def without_inputs(self, *, scene: Scene, velocity: float) -> TubeHeads:
        """The heads with models' uncertainties alone, for velocities within a factor of e^4 of one, m/s."""
        place = crest_end_uncertainty(scene.tube, 0.0)
        log_velocity = np.log(velocity) + np.linspace(-4.0, 4.0, 33)
        widths = _widths(scene, log_velocity, place=place, by_inputs=False)
        return replace(self, **widths)  # type: ignore[arg-type]


def _inconsistent(scene: Scene) -> Exception:
    """That the head falls where the velocity grows, by what the scene says of its models or by them alone."""
    problem = "the tube's head does not grow with the velocity"
    if not scene.tube.model_errors:
        return ValueError(f"{problem}: its loss terms are inconsistent")
    fault = scene_fault(
        scene, "tube.model_errors", problem=f"with these corrections {problem}", allowed="smaller ones"
    )
    written = [
        {"cause": each.cause, "even": plain(np.mean(each.even)), "odd": plain(np.mean(each.odd))}
        for each in scene.tube.model_errors
    ]
    return SceneError([replace(fault, value=toml_text(written))])


def _sampled(scene: Scene, count: int) -> list[FloatArray]:
    """`log_heads` over even places, shape (count, designs).

    Raises: as `TubeHeads.nominal`.
    """
    start, stop = (float(v) for v in np.log(TABLE_VELOCITIES))
    places = np.linspace(start, stop, count)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        values = log_heads(scene, places)
    if not np.all(np.isfinite(values)):
        raise _inconsistent(scene)
    if scene.tube.model_errors:
        values = [_growing(scene, places, value) for value in values]
    return values


def velocity_of(*, table: HermiteTable, head: npt.ArrayLike, where: BoolArray) -> FloatArray:
    """Velocity that belongs to a head.

    Returns: u, m/s, the shape of `head`.
    """
    # A pressure above zero may make a head that is rounded to zero.
    flows = where & (np.asarray(head) > 0)
    return np.where(flows, np.exp(table.inverse(np.log(np.where(flows, head, 1.0)))), 0.0)


def _growing(scene: Scene, log_velocity: FloatArray, log_head: FloatArray) -> FloatArray:
    """A head with supposed errors of models, level where these make it fall a little.

    Sizes of errors change fast where the flow turns turbulent. Its largest value up to a velocity is taken,
    rising by `_RISE` per unit of ln u, so that one velocity belongs to each.
    Raises: SceneError: it falls by more than `_LEVELLED`, or is none.
    """
    highest = np.maximum.accumulate(log_head, axis=0)
    if not np.all(highest - log_head <= _LEVELLED):
        raise _inconsistent(scene)
    return highest + _RISE * log_velocity


def _widths(
    scene: Scene, log_velocity: FloatArray, *, place: float, by_inputs: bool = True
) -> dict[str, HermiteTable]:
    """Uncertainties of `TubeHeads` over even places in ln u, but for those of inputs fitted together.

    Args: `place`: uncertainty of the crest's end.
    """
    tube, u, end = scene.tube, np.exp(log_velocity), crest_span(scene.tube)[1]
    state = tube_state(scene, u)
    right = with_errors(tube=tube, state=state)
    parts: Mapping[str, FloatArray] = unfitted_parts(scene, model_parts(tube=tube, state=state))
    if by_inputs:
        parts = uncertainty_parts(scene, velocity=u, state=state, fitted=False)
    k, upstream = right.k, right.upstream_loss(end)
    width = np.sqrt(sum((part**2 for part in parts.values()), start=np.zeros_like(k)))
    share = np.where(k > 0, upstream / np.where(k > 0, k, 1.0), 1.0)
    to_crest = right.kinetic_factor + upstream
    moved = np.hypot(width * share, state.along * place)
    found = {
        "uncertainty": width / (k + 1),
        "hump_uncertainty": moved / to_crest,
        "fraction_uncertainty": _fraction_uncertainty(tube, state, parts, place),
    }
    ends = float(log_velocity[0]), float(log_velocity[-1])
    return {name: level_table(start=ends[0], stop=ends[1], value=value) for name, value in found.items()}


def _fraction_uncertainty(
    tube: Tube, state: TubeState, parts: Mapping[str, FloatArray], place: float
) -> FloatArray:
    """(s_j - R)/(k + 1) of each part of k with a fraction s_j before the crest's end, and of its place."""
    total, end = state.k + 1, crest_span(tube)[1]
    fraction = (state.kinetic_factor + state.upstream_loss(end)) / total
    squares = (state.along * place / total) ** 2
    for name, part in parts.items():
        # Which end or bend is wrong is not known: then the worse of before and behind the crest.
        lumped = name in {"ends", "bends"}
        lever = np.maximum(fraction, 1 - fraction) if lumped else np.abs(end - fraction)
        squares = squares + (lever * part / total) ** 2
    return np.asarray(np.sqrt(squares))


def log_heads(scene: Scene, log_velocity: FloatArray) -> list[FloatArray]:
    """Natural logarithms of the heads: between the chambers and, with a crest, from either chamber to it."""
    tube, u = scene.tube, np.exp(log_velocity)
    state = corrected_state(scene, u)
    between = np.log((state.k + 1) / 2) + 2 * log_velocity
    if tube.hump_radius is None:
        return [between]
    back = reversed_tube(tube), replace(state, bends=state.bends[::-1])
    to_crest = (
        crest_head(scene=scene, tube=seen, state=there, velocity=u) for seen, there in ((tube, state), back)
    )
    return [between, *map(np.log, to_crest)]


def crest_head(
    *, scene: Scene, tube: Tube, state: TubeState, velocity: FloatArray, lowest: bool = True
) -> FloatArray:
    """Head from the giving chamber to the lowest pressure at the crest, or to its arc's end, m^2/s^2."""
    kinetic = velocity**2 / 2
    fall = (state.kinetic_factor + state.upstream_loss(crest_span(tube)[1])) * kinetic
    if not lowest:
        return np.asarray(fall)
    behind = head_behind_crest(tube=tube, along=state.along * kinetic, square=scene.rotor.speed**2)
    return np.asarray(fall + behind)


def entrance_fraction(scene: Scene, u: FloatArray) -> FloatArray:
    """Fraction of the head up to the crest that is lost at the entrance, (alpha + K_ent)/(alpha + k_up).

    Args: `u`: velocities, m/s, of the designs if there are many.
    """
    state = corrected_state(scene, u)
    entrance = (state.kinetic_factor + state.terms.get("entrance", 0.0)) * u**2 / 2
    return np.asarray(entrance / crest_head(scene=scene, tube=scene.tube, state=state, velocity=u))
