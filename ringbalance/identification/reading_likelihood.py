"""Likelihood of files in an alternative reading.

    -2 ln L = sum (e/s)^2 + priors + 2 sum n_g ln s_g + ln det A'A - 2 ln det L^-1 - 2 ln |dy'/dy|,

restricted for parameters, held inputs and free unknowns (A their slopes), with the noise of each group
estimated again and y' the measured numbers in the alternative reading.  That reading is fitted linearly from
the scene, which costs a little by curvature, but exactly in influence coefficient and lag, to which
vibrations are proportional; the given reading has its optimum.
Source: restricted likelihood, Harville, J. Am. Stat. Assoc. 72 (1977) 320; slopes of held inputs are scaled
with the prediction, an assumption without source.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from scipy.special import stdtr

from ringbalance.identification.likelihood import DataBlock, Problem
from ringbalance.identification.misreadings import Joint
from ringbalance.identification.optimisation import Optimum, optimum_as_stated
from ringbalance.identification.parameters import FitError
from ringbalance.scene.arrays import FloatArray

_ROUNDS: Final = 12
_AGREES: Final = 1e-2
"""Relative change of the noise at which its iteration ends."""
_LEAST_NOISE: Final = 1e-6
"""Smallest noise over the root mean square of a group's data."""
_FREE_SIGMA: Final = 1.0
"""Standard deviation, in t, of a parameter without a prior."""
_STEPS: Final = 8
"""Largest number of Newton steps for influence coefficient and lag."""
_SETTLED_CHANGE: Final = 1e-3
"""Relative change of the influence coefficient at which its iteration ends."""
_LEAST_CHANCE: Final = 1e-300
_MIN_FREEDOM: Final = 0.5
"""Smallest degrees of freedom of a group."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _ReadingRows:
    """Numbers of one file before whitening: prediction at the start, slopes, effects of held inputs."""

    block: DataBlock
    predicted: FloatArray
    slopes: FloatArray
    held: FloatArray

    @property
    def vibration(self) -> bool:
        """True if the numbers are real and imaginary parts, proportional to the influence coefficient."""
        return self.block.measured.size == 2 * len(self.block.observations)

    def times(self, factor: complex) -> _ReadingRows:
        """Rows with the influence coefficient multiplied by a factor."""
        if not self.vibration or factor == 1:
            return self
        turn = np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])

        def turned(values: FloatArray) -> FloatArray:
            both = np.reshape(values, (2, len(self.block.observations), -1))
            return np.reshape(np.einsum("ij,j...->i...", turn, both), values.shape)

        return _ReadingRows(
            block=self.block,
            predicted=turned(self.predicted),
            slopes=turned(self.slopes),
            held=turned(self.held),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadingComparison:
    """Comparison of a fit's files as given with alternative readings, by likelihood."""

    problem: Problem
    rows: tuple[_ReadingRows, ...]
    deviance: float
    """-2 ln L of the files as given."""
    pulled: FloatArray
    """Held inputs of the predictions, in standard deviations."""
    changed: dict[tuple[int, tuple[str, ...]], _ReadingRows | None]
    """Cached rows by file and changed settings; None if they cannot be predicted."""
    refits: dict[tuple[Joint, tuple[int, ...]], float]
    """Cached gains of complete fits."""

    @classmethod
    def of(cls, best: Optimum) -> ReadingComparison:
        """Comparison with a fit, from predictions and slopes at the scene's values."""
        problem, start = best.residuals.problem, best.residuals.problem.start
        values = (problem.at(start)[:, None], problem.quick_slopes(start), best.residuals.held)
        parts = zip(problem.blocks, *(_unwhitened(problem, each) for each in values), strict=True)
        rows = tuple(_ReadingRows(block=b, predicted=f[:, 0], slopes=s, held=h) for b, f, s, h in parts)
        pulled = best.residuals.pulled
        return cls(
            problem=problem, rows=rows, deviance=deviance_of(best), pulled=pulled, changed={}, refits={}
        )

    def gain(self, joint: Joint, chosen: Sequence[int]) -> float | None:
        """Gain of the log likelihood by an alternative reading of some files; None: no prediction."""
        rows = list(self.rows)
        for i in chosen:
            changed = self._changed(joint, i)
            if changed is None:
                return None
            rows[i] = changed
        problem = replace(self.problem, blocks=tuple(r.block for r in rows))
        least = min(self._deviance(problem, rows, t) for t in self._starts(problem, rows))
        gain = (self.deviance - least) / 2 + self.jacobian(joint, chosen)
        return gain if math.isfinite(gain) else None

    def jacobian(self, joint: Joint, chosen: Sequence[int]) -> float:
        """ln |dy'/dy| of an alternative reading of some files."""
        size = sum(self.rows[i].block.measured.size for i in chosen)
        return size * sum(math.log(each.scale) for each in joint)

    def refitted(self, joint: Joint, chosen: tuple[int, ...], scene: Any) -> float:
        """Gain by a complete fit from the scene as stated; minus infinity if there is none.

        A wrong reading pulls held inputs far from their values in another reading.
        """
        if (joint, chosen) in self.refits:
            return self.refits[joint, chosen]
        blocks, gain = list(self.problem.blocks), -math.inf
        for i in chosen:
            for each in joint:
                changed = each.change(blocks[i].observations, scene)
                blocks[i] = DataBlock(observations=changed) if changed is not None else blocks[i]
        problem = replace(self.problem, scene=scene, blocks=tuple(blocks))
        with suppress(FitError, ValueError):
            best, _ = optimum_as_stated(problem, loss="linear", starts=1)
            gain = (self.deviance - deviance_of(best)) / 2 + self.jacobian(joint, chosen)
        self.refits[joint, chosen] = gain
        return gain

    @cached_property
    def _response(self) -> list[int]:
        """Columns of influence coefficient and lag; empty if any prediction is not proportional to them."""
        wanted = [_column_of(self.problem, name) for name in ("influence_coefficient", "lag_angle")]
        columns = [column for column in wanted if column is not None]
        others = (rows.slopes[:, columns] for rows in self.rows if not rows.vibration)
        return [] if len(columns) < len(wanted) or any(map(np.any, others)) else columns

    def _starts(self, problem: Problem, rows: Sequence[_ReadingRows]) -> Iterator[FloatArray]:
        """Yield t of the scene, and t with the influence coefficient that explains the vibrations best."""
        yield problem.start
        if not self._response:
            return
        vibration = np.concatenate([np.full(each.block.measured.size, each.vibration) for each in rows])
        sides = [
            np.concatenate([each.block.whiten @ each.times(factor).predicted for each in rows])
            for factor in (1, 1j)
        ]
        columns = np.column_stack([*sides, problem.free])[vibration]
        scales = np.linalg.norm(columns, axis=0)
        if np.all(scales[:2] > 0):
            scales[scales == 0] = 1.0
            real, imaginary, *_ = np.linalg.lstsq(columns / scales, problem.measured[vibration])[0] / scales
            yield self._moved(problem.start, complex(real, imaginary))

    def _moved(self, t: FloatArray, factor: complex) -> FloatArray:
        """t with the influence coefficient multiplied by a factor."""
        moved = t.copy()
        if factor != 0:
            moved[self._response] += math.log(abs(factor)), -cmath.phase(factor)
        return moved

    def _deviance(self, problem: Problem, rows: Sequence[_ReadingRows], t: FloatArray) -> float:
        """-2 ln L, linearised except in influence coefficient and lag."""
        deviance = math.inf
        for _ in range(_STEPS):
            factor = 1.0 + 0j
            if self._response:
                kappa, lag = (t - problem.start)[self._response]
                factor = cmath.exp(complex(kappa, -lag))
            turned = [each.times(factor) for each in rows]
            predicted, slopes, held = (
                np.concatenate([each.block.whiten @ getattr(each, name) for each in turned])
                for name in ("predicted", "slopes", "held")
            )
            deviance, step = _settled(problem, t, predicted, slopes, held, self.pulled)
            if not self._response or not math.isfinite(deviance):
                break
            turn = 1 + complex(*(step[self._response] * (1, -1)))
            if abs(turn - 1) < _SETTLED_CHANGE:
                break
            t = self._moved(t, turn)
        return deviance

    def _changed(self, joint: Joint, i: int) -> _ReadingRows | None:
        """Rows of a file in an alternative reading, as far as that applies; None: no prediction."""
        rows, problem = self.rows[i], self.problem
        observations = rows.block.observations
        settings: tuple[str, ...] = ()
        for each in joint:
            changed = each.change(observations, problem.scene)
            if changed is not None:
                observations = changed
                settings = (*settings, each.code) if each.settings else settings
        block = DataBlock(observations=observations)
        if settings and (i, settings) not in self.changed:
            alone = replace(problem, blocks=(block,))
            try:
                predicted = _unwhitened(alone, alone.at(problem.start)[:, None])[0][:, 0]
                slopes = _unwhitened(alone, alone.quick_slopes(problem.start))[0]
            except ValueError:
                self.changed[i, settings] = None
            else:
                # Effects of held inputs are rotated and scaled with the prediction of each row.
                before, after, held = (
                    values[: len(values) // 2] + 1j * values[len(values) // 2 :] if rows.vibration else values
                    for values in (rows.predicted, predicted, rows.held)
                )
                moved = np.divide(after, before, out=np.zeros_like(after), where=before != 0)[:, None] * held
                held = np.concatenate([moved.real, moved.imag]) if rows.vibration else moved
                self.changed[i, settings] = _ReadingRows(
                    block=block, predicted=predicted, slopes=slopes, held=held
                )
        other = self.changed[i, settings] if settings else rows
        return None if other is None else replace(other, block=block)


def deviance_of(best: Optimum) -> float:
    """-2 ln L at an optimum."""
    residuals, predicted = best.residuals, best.residuals.problem.at(best.t)
    slopes, held, pulled = best.of_prediction, residuals.held, residuals.pulled
    return _settled(residuals.problem, best.t, predicted, slopes, held, pulled)[0]


def _unwhitened(problem: Problem, values: FloatArray) -> list[FloatArray]:
    """Columns of numbers, file by file, before L^-1."""
    parts = np.split(values, np.cumsum([b.measured.size for b in problem.blocks])[:-1])
    return [np.asarray(np.linalg.solve(b.whiten, p)) for b, p in zip(problem.blocks, parts, strict=True)]


def _column_of(problem: Problem, name: str) -> int | None:
    names = [each.name.rpartition(".")[2] for each in problem.parameters]
    return names.index(name) if name in names else None


def passive(lag: float) -> bool:
    """Return True for a lag, rad, of a passive rotor: from 0 to 180 degrees."""
    return lag % (2 * math.pi) <= math.pi


def _settled(
    problem: Problem,
    t: FloatArray,
    predicted: FloatArray,
    slopes: FloatArray,
    held: FloatArray,
    pulled: FloatArray,
) -> tuple[float, FloatArray]:
    """-2 ln L of the problem linearised at t, with converged noise, and the step to its optimum.

    Infinite if a group has no degrees of freedom left.
    """
    group, groups = problem.group, range(len(problem.estimated_groups))
    design, count = np.hstack([slopes, problem.free, held]), problem.measured.size
    # Priors of the unknowns, each row over its standard deviation, and their residuals at t.
    priors = np.zeros((t.size + held.shape[1], design.shape[1]))
    priors[t.size :, design.shape[1] - held.shape[1] :] = np.eye(held.shape[1])
    off = np.concatenate([(problem.start - t) / _FREE_SIGMA, -pulled])
    for i, (parameter, inner) in enumerate(zip(problem.parameters, t.tolist(), strict=True)):
        priors[i, i] = parameter.slope(inner) / parameter.prior if parameter.prior else 1 / _FREE_SIGMA
        if parameter.prior:
            off[i] = (parameter.start - parameter.value(inner)) / parameter.prior
    apart = problem.measured - predicted
    least = np.array([_LEAST_NOISE * _size(problem.measured[group == g]) for g in groups])
    settled = np.maximum([_size(apart[group == g]) for g in groups], least)
    for _ in range(_ROUNDS):
        noise = settled
        s = np.where(group < 0, 1.0, noise[group]) if noise.size else np.ones(count)
        left = np.concatenate([apart / s, off])
        base, triangle = np.linalg.qr(np.concatenate([design / s[:, None], priors]))
        components = base.T @ left
        rest, taken = left - base @ components, np.sum(base[:count] ** 2, axis=1)
        freedom = np.array([np.sum(1 - taken[group == g]) for g in groups])
        if np.any(freedom < _MIN_FREEDOM):
            return math.inf, np.zeros_like(components)
        squares = np.array([np.sum(rest[:count][group == g] ** 2) for g in groups])
        settled = np.maximum(noise * np.sqrt(squares / freedom), least)
        if np.max(np.abs(settled / noise - 1), initial=0.0) < _AGREES:
            break
    inverse = np.linalg.pinv(triangle)
    step, widths = inverse @ components, np.linalg.norm(inverse, axis=1)
    sizes = np.maximum(np.abs(np.diag(triangle)), 1e-12)
    whitening = sum(float(np.sum(np.log(np.diag(b.whiten)))) for b in problem.blocks)
    chance, lag_column = 1.0, _column_of(problem, "lag_angle")
    # Probability of a lag between 0 and 180 degrees, unless that of the scene lies outside.
    if lag_column is not None and passive(problem.parameters[lag_column].start):
        lag = (float(t[lag_column] + step[lag_column]) + math.pi / 2) % (2 * math.pi) - math.pi / 2
        vibrations = {b.group for b in problem.blocks if b.measured.size == 2 * len(b.observations)}
        named = zip(problem.estimated_groups, freedom.tolist(), strict=True)
        nu = min((each for name, each in named if name in vibrations), default=math.inf)
        nearer = min(lag, math.pi - lag)
        inside, beyond = stdtr(min(nu, 1e9), np.array([nearer, nearer - math.pi]) / widths[lag_column])
        chance = max(float(inside - beyond), _LEAST_CHANCE)
    logs = 2 * float(np.sum(np.log(s))) + 2 * float(np.sum(np.log(sizes)))
    return float(rest @ rest) + logs - 2 * whitening - 2 * math.log(chance), step


def _size(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) or 1e-300
