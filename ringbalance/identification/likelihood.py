"""Residuals of a fit in units of their standard deviation, from data, priors and held inputs.

With y the measured numbers, f(t) their prediction, L L' the covariance that the data state (up to a factor
s^2 for each group whose noise is estimated), the model is

    y = f(t) + B b + J (n - n0) + s L e,   e, n independent standard normal,

b unknowns that are no parameters (the vibration without trial weight), n the held uncertain inputs of the
scene, in units of their standard deviations, with effect J at n0, initially zero.  b and n are
linear and eliminated by projection, so that -2 ln L is, apart from constants,

    |(1 - Q Q') [L^-1 (y - f(t))/s; -n0]|^2 + sum ((x - x0)/sigma_x)^2 + 2 sum ln s,

Q an orthonormal base of [[L^-1 B/s, L^-1 J/s], [0, 1]]; each prior counts once.
Source: variable projection, Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Final

import numpy as np
from scipy.linalg import block_diag

from ringbalance.identification.kinds.kind import Kind, Observations
from ringbalance.identification.parameters import Parameter
from ringbalance.identification.reading import KINDS
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray

STEP: Final = 1e-3
"""Step of central differences in t; their error is STEP^2/6 times a third derivative of order one."""
_RANK: Final = 1e-10
"""Smallest singular value that counts, relative to the largest."""
_MIN_STEP_FRACTION: Final = 1e-2
"""Smallest step next to a bound, as a fraction of `STEP`; below it no difference to that side is formed."""
_JUMP: Final = 0.1
"""Largest difference of the slopes on both sides over the sum of their magnitudes; beyond it lies a jump."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DataBlock:
    """One file of measurements, whitened to independent errors."""

    observations: Observations

    @property
    def kind(self) -> Kind:
        """Kind of the file, looked up since its functions cannot be pickled."""
        return KINDS[self.observations.kind]

    @cached_property
    def measured(self) -> FloatArray:
        """Measured numbers y, SI, shape (n,)."""
        return self.kind.numbers(self.observations)

    @cached_property
    def whiten(self) -> FloatArray:
        """Whitening matrix L^-1, shape (n, n)."""
        return np.asarray(np.linalg.inv(np.linalg.cholesky(self.kind.covariance(self.observations))))

    @cached_property
    def free(self) -> FloatArray:
        """Effects B of the unknowns b, shape (n, m)."""
        effects = self.kind.free(self.observations)
        return effects if effects.size else np.zeros((self.measured.size, 0))

    @property
    def column(self) -> str:
        """Name of the measured column whose noise is stated or estimated."""
        return self.kind.noisy_column(self.observations)

    @property
    def group(self) -> str:
        """Kind and column that share one noise."""
        return f"{self.observations.kind} {self.column}"

    @property
    def estimated(self) -> bool:
        """True if the noise is estimated from the residuals."""
        return not self.kind.noise_given(self.observations)

    def predicted(self, scene: Any, models: Any) -> FloatArray:
        """Predicted numbers f of a scene, SI, shape (n,)."""
        return self.kind.predict(scene, self.observations, models)


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """Parameters of a scene and the files that they are fitted to."""

    scene: Any
    models: Any
    """Models for predictions of this scene, fixed during the fit."""
    parameters: tuple[Parameter, ...]
    blocks: tuple[DataBlock, ...]

    def scene_at(self, t: FloatArray) -> Any:
        """Scene with the parameters at t."""
        scene = self.scene
        for parameter, inner in zip(self.parameters, t.tolist(), strict=True):
            scene = parameter.change(scene, parameter.value(inner))
        return scene

    @cached_property
    def rows(self) -> tuple[tuple[DataBlock, slice], ...]:
        """Every block with the slice of its numbers among all numbers."""
        ends = np.cumsum([0, *(b.measured.size for b in self.blocks)]).tolist()
        return tuple(zip(self.blocks, (slice(*each) for each in pairwise(ends)), strict=True))

    @cached_property
    def _known(self) -> dict[bytes, FloatArray]:
        return {}

    @property
    def evaluations(self) -> int:
        """Number of predictions of all data so far."""
        return len(self._known)

    def at(self, t: FloatArray) -> FloatArray:
        """Whitened prediction L^-1 f at t, cached."""
        key = t.tobytes()
        if key not in self._known:
            scene = self.scene_at(t)
            predicted = [b.whiten @ b.predicted(scene, self.models) for b in self.blocks]
            self._known[key] = np.concatenate(predicted)
        return self._known[key]

    def slopes(self, t: FloatArray) -> FloatArray:
        """d(L^-1 f)/dt by central differences, one-sided next to a bound, shape (n, parameters).

        If a prediction jumps, as when liquid just reaches the crest, the smaller of both one-sided
        differences counts, without the jump.
        """
        ends = [np.clip(t + step, *self.bounds) for step in (-STEP, STEP)]
        # Next to a bound a difference would consist of round-off.
        below, above = (np.where(np.abs(end - t) < _MIN_STEP_FRACTION * STEP, t, end) for end in ends)
        down, up = np.split(self._differences(t, np.concatenate([below, above])), 2, axis=1)
        part = (t - below) / (above - below)
        apart = np.abs(up - down) > _JUMP * (np.abs(up) + np.abs(down))
        smaller = np.where(np.abs(up) < np.abs(down), up, down)
        return np.where(apart & (part > 0) & (part < 1), smaller, part * down + (1 - part) * up)

    def quick_slopes(self, t: FloatArray) -> FloatArray:
        """d(L^-1 f)/dt by one-sided differences, for a search."""
        return self._differences(t, np.where(t + STEP < self.bounds[1], t + STEP, t - STEP))

    def _differences(self, t: FloatArray, ends: FloatArray) -> FloatArray:
        """Slopes of L^-1 f from t to the given ends of each parameter in turn; zero for a step of zero."""
        which = np.arange(ends.size) % t.size
        points = [np.where(np.arange(t.size) == i, end, t) for i, end in zip(which, ends, strict=True)]
        if self.models is not None:
            # Their laws are computed together.
            unknown = [each for each in (t, *points) if each.tobytes() not in self._known]
            self.models.expect([self.scene_at(each) for each in unknown])
        center, *values = map(self.at, (t, *points))
        step = ends - t[which]
        return (np.stack(values, axis=1) - center[:, None]) / np.where(step == 0, 1.0, step)

    @cached_property
    def measured(self) -> FloatArray:
        """Whitened measured numbers L^-1 y."""
        return np.concatenate([b.whiten @ b.measured for b in self.blocks])

    @cached_property
    def free(self) -> FloatArray:
        """Whitened effects L^-1 B."""
        return np.asarray(block_diag(*(b.whiten @ b.free for b in self.blocks)))

    @cached_property
    def group(self) -> IntArray:
        """Index into `estimated_groups` of every number; -1 for a stated noise."""
        names = self.estimated_groups
        return np.concatenate(
            [np.full(b.measured.size, names.index(b.group) if b.estimated else -1) for b in self.blocks]
        ).astype(np.int64)

    @cached_property
    def estimated_groups(self) -> tuple[str, ...]:
        """Groups with an estimated noise."""
        return tuple(dict.fromkeys(b.group for b in self.blocks if b.estimated))

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of t."""
        low, high = (
            np.array([p.inner(end) for p, end in zip(self.parameters, ends, strict=True)])
            for ends in zip(*((p.lowest, p.highest) for p in self.parameters), strict=True)
        )
        return low, high

    @property
    def start(self) -> FloatArray:
        """t of the scene, within the bounds."""
        low, high = self.bounds
        inner = np.array([p.inner(p.start) for p in self.parameters])
        return np.asarray(np.clip(inner, low, high), dtype=np.float64)

    def priors(self, t: FloatArray) -> FloatArray:
        """(x - x0)/sigma_x of the parameters that have a prior."""
        both = zip(self.parameters, t.tolist(), strict=True)
        return np.array([(p.value(x) - p.start) / p.prior for p, x in both if p.prior])

    def prior_slopes(self, t: FloatArray) -> FloatArray:
        """d(priors)/dt, shape (priors, parameters)."""
        both = zip(self.parameters, t.tolist(), strict=True)
        rows = np.diag([p.slope(x) / p.prior if p.prior else 0.0 for p, x in both])
        return np.asarray(rows[self.with_prior])

    @cached_property
    def with_prior(self) -> BoolArray:
        """True for each parameter with a prior."""
        return np.array([bool(p.prior) for p in self.parameters])

    def held_effects(self, t: FloatArray, changes: Sequence[tuple[Any, Any]]) -> FloatArray:
        """L^-1 J: change of the prediction per standard deviation of each held input, shape (n, inputs).

        Args: `changes`: for each input, the scene with it one standard deviation lower, or unchanged, and one
            higher.
        """
        moved = [
            self if side == self.scene else replace(self, scene=side) for change in changes for side in change
        ]
        if self.models is not None:
            self.models.expect([each.scene_at(t) for each in moved])
        predicted = np.array([each.at(t) for each in moved]).reshape(-1, 2, self.measured.size)
        steps = [1 if low is self else 2 for low in moved[::2]]
        return np.asarray((predicted[:, 1] - predicted[:, 0]).T / np.array(steps))


@dataclass(frozen=True, kw_only=True, eq=False)
class Residuals:
    """Residuals of a problem for given noise, held inputs and weights."""

    problem: Problem
    noise: FloatArray
    """s of each estimated group."""
    held: FloatArray
    """L^-1 J, shape (n, held inputs)."""
    weights: FloatArray
    """Weights of squares in a robust loss, shape (n,); ones for a linear loss."""
    pulled: FloatArray
    """n0 of the problem's scene and of J, shape (held inputs,); zero for inputs as stated."""

    @cached_property
    def scale(self) -> FloatArray:
        """sqrt(weight)/s of every number."""
        group = self.problem.group
        s = np.ones(group.size) if self.noise.size == 0 else np.where(group < 0, 1.0, self.noise[group])
        return np.asarray(np.sqrt(self.weights) / s)

    @cached_property
    def linear(self) -> FloatArray:
        """Matrix [[L^-1 B/s, L^-1 J/s], [0, 1]]."""
        free, held = self.problem.free, self.held
        top = self.scale[:, None] * np.concatenate([free, held], axis=1)
        count = held.shape[1]
        below = np.concatenate([np.zeros((count, free.shape[1])), np.eye(count)], axis=1)
        return np.concatenate([top, below])

    @cached_property
    def base(self) -> FloatArray:
        """Orthonormal base Q, without directions of negligible singular value."""
        return basis_of(self.linear)

    def at(self, t: FloatArray, *, predicted: FloatArray | None = None) -> FloatArray:
        """Residuals of the data and held inputs, with b and n eliminated, then of the priors."""
        prediction = self.problem.at(t) if predicted is None else predicted
        full = np.concatenate([self.scale * (self.problem.measured - prediction), -self.pulled])
        return np.concatenate([full - self.base @ (self.base.T @ full), self.problem.priors(t)])

    def slopes(self, t: FloatArray, of_prediction: FloatArray) -> FloatArray:
        """d(residuals)/dt, with b and n eliminated. Args: `of_prediction`: d(L^-1 f)/dt."""
        below = np.zeros((self.held.shape[1], of_prediction.shape[1]))
        full = np.concatenate([self.scale[:, None] * of_prediction, below])
        return np.concatenate([-(full - self.base @ (self.base.T @ full)), self.problem.prior_slopes(t)])

    def leverage(self, slopes: FloatArray) -> FloatArray:
        """Leverage of parameters, b and n on each number of the data.

        Args: `slopes`: d(residuals)/dt.
        """
        both = np.hstack([basis_of(slopes)[: self.scale.size], self.base[: self.scale.size]])
        return np.asarray(np.sum(both**2, axis=1))

    def linear_values(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Most likely b and n at t."""
        left = self.scale * (self.problem.measured - self.problem.at(t))
        full = np.concatenate([left, -self.pulled])
        values = np.linalg.lstsq(self.linear, full, rcond=1e-10)[0]
        count = values.size - self.pulled.size
        return values[:count], self.pulled + values[count:]


def basis_of(columns: FloatArray) -> FloatArray:
    """Orthonormal basis of the space of some columns."""
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, size > _RANK * np.max(size, initial=1e-300)])
