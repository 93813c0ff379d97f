"""Fidelity levels: what each quantity may be computed with, in order of increasing cost, and what each model
leaves out.

A model hierarchy belongs to one quantity that users ask for.  Its models are sets of models; each says by
name which physical terms of the registry it leaves out and how much work it counts, so that a tolerance can
pick the cheapest that will do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ringbalance.physics.results import Status
from ringbalance.reduced_model.contribution import Contribution
from ringbalance.scene.arrays import FloatArray

Work = Mapping[str, float]
"""Counted work by its kind, such as {"solve": 3, "unknown_2d": 1000}; never a time."""


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """One set of models for one quantity."""

    name: str
    """Short and unique within its model hierarchy."""
    models: Mapping[str, str]
    """Model of each part, for people."""
    leaves_out: frozenset[str]
    """Names of the contributions that this set lacks."""
    work: Work
    """For one point of the hierarchy."""
    fixed_work: Work = field(default_factory=dict)
    """Once, however many points: tables that are built first."""
    solve: Callable[[int], FloatArray]
    """From the number of a point to the quantity's values there, shape (m,); SI."""
    fresh: Callable[[int], object] | None = None
    """The same work repeated, where `solve` remembers; for timing."""
    prepare: Callable[[], object] | None = None
    """The fixed work repeated; for timing."""

    def counted(self, points: int) -> Work:
        """Work over a number of points, that before them included."""
        each, once = self.work, self.fixed_work
        return {kind: points * each.get(kind, 0.0) + once.get(kind, 0.0) for kind in {**each, **once}}


@dataclass(frozen=True, kw_only=True)
class ModelHierarchy:
    """All models of one quantity for one scene; the last one is the finest."""

    quantity: str
    """Identifier, such as "wall_pressure"."""
    title: str
    values: tuple[str, ...]
    """What stands at each place of a point's values, with its unit."""
    points: tuple[str, ...]
    """Where the quantity is asked for, in words."""
    check: tuple[int, ...]
    """Numbers of the points at which a choice is checked."""
    relative_to: Literal["each", "largest"]
    """Whether an error is relative to each value or to the largest of its kind over the points."""
    contributions: Mapping[str, Contribution]
    fidelities: tuple[Fidelity, ...]
    top_uncertainty: float
    """Of the finest model itself, relative, expanded uncertainty (95 %)."""
    top_uncertainty_from: str
    """What that consists of."""
    status: Status = field(default_factory=Status)
    """What the scene cannot be asked, and what to do."""

    @property
    def top(self) -> Fidelity:
        """The finest model."""
        return self.fidelities[-1]


class Values:
    """Values of a hierarchy's models at its points, each computed once."""

    def __init__(self, hierarchy: ModelHierarchy) -> None:
        """Start with nothing computed."""
        self.hierarchy = hierarchy
        self._found: dict[tuple[str, int], FloatArray] = {}

    def at(self, fidelity: Fidelity, points: tuple[int, ...]) -> FloatArray:
        """Values of a model at points given by their numbers, shape (points, m)."""
        for point in points:
            if (fidelity.name, point) not in self._found:
                self._found[fidelity.name, point] = fidelity.solve(point)
        return np.array([self._found[fidelity.name, point] for point in points])

    def error(
        self, fidelity: Fidelity, reference: Fidelity | None = None, points: tuple[int, ...] | None = None
    ) -> float:
        """Largest relative error of a model against another at points; default: the finest, at all."""
        places = tuple(range(len(self.hierarchy.points))) if points is None else points
        return relative_error(
            found=self.at(fidelity, places),
            reference=self.at(reference or self.hierarchy.top, places),
            relative_to=self.hierarchy.relative_to,
        )


def relative_error(
    *, found: FloatArray, reference: FloatArray, relative_to: Literal["each", "largest"]
) -> float:
    """Largest relative error of values of shape (points, m); a difference from zero counts as 1.

    Args: `relative_to`: "each": to the reference at each place; "largest": to its largest magnitude over the
        points, column by column.
    """
    size = np.abs(reference)
    if relative_to == "largest":
        size = np.broadcast_to(size.max(axis=0, keepdims=True), reference.shape)
    difference = np.abs(found - reference)
    share = difference / np.where(size > 0, size, np.where(difference > 0, difference, 1.0))
    return float(np.max(share, initial=0.0))
