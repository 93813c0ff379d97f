"""How likely files are, read otherwise than they stand.

    -2 ln L = sum (e/s)^2 + priors + 2 sum n_g ln s_g + ln det A'A - 2 ln det L^-1 - 2 ln |dy'/dy|,

restricted to what parameters, held inputs and free unknowns leave (A their slopes), the noise of each group
estimated again, y' what was measured as the other reading has it.  The other reading is fitted linearly from
the scene, so that it loses a little by curvature, and exactly in the influence coefficient and the lag, which
vibrations are in proportion to; the given one from its optimum.
Source: restricted likelihood, Harville, J. Am. Stat. Assoc. 72 (1977) 320; slopes of held inputs in
proportion to the prediction are ours.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from scipy.special import stdtr

from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.likelihood import Block, Problem
from ringbalance.identification.misreadings import Joint, Misreading
from ringbalance.identification.optimisation import Optimum, optimum_as_stated
from ringbalance.identification.parameters import FitError
from ringbalance.scene.arrays import FloatArray

_ROUNDS: Final = 12
_AGREES: Final = 1e-2
_LEAST_NOISE: Final = 1e-6
"""Of the root mean square of what a group measured."""
_WIDE: Final = 1.0
"""Standard deviation of a parameter of which nothing is known, in its own scale."""
_STEPS: Final = 8
"""Of Newton, to the influence coefficient and the lag."""
_CLOSE: Final = 1e-3
_LEAST_CHANCE: Final = 1e-300


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rows:
    """Numbers of one file before whitening: predicted at the start, slopes, effects of held inputs."""

    block: Block
    predicted: FloatArray
    slopes: FloatArray
    held: FloatArray

    @property
    def vibration(self) -> bool:
        """Whether its numbers are real and imaginary parts, in proportion to the influence coefficient."""
        return self.block.measured.size == 2 * len(self.block.observations)

    def times(self, factor: complex) -> _Rows:
        """The same with another influence coefficient."""
        if not self.vibration or factor == 1:
            return self
        turn = np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])

        def turned(values: FloatArray) -> FloatArray:
            both = np.reshape(values, (2, len(self.block.observations), -1))
            return np.reshape(np.einsum("ij,j...->i...", turn, both), values.shape)

        return _Rows(
            block=self.block,
            predicted=turned(self.predicted),
            slopes=turned(self.slopes),
            held=turned(self.held),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Likelihood of a fit's files as they stand, and as other readings of them would have it."""

    problem: Problem
    rows: tuple[_Rows, ...]
    given: float
    """-2 ln L of the files as they stand."""
    pulled: FloatArray
    """Held inputs at which predictions are made, in standard deviations."""

    @classmethod
    def of(cls, best: Optimum) -> Comparison:
        """Predictions and slopes about the scene's values, and the fit that readings are compared with."""
        problem, start = best.residuals.problem, best.residuals.problem.start
        raw = _unwhitened(problem, problem.at(start)[:, None])
        slopes = _unwhitened(problem, problem.quick_slopes(start))
        held = _unwhitened(problem, best.residuals.held)
        rows = tuple(
            _Rows(block=b, predicted=f[:, 0], slopes=s, held=h)
            for b, f, s, h in zip(problem.blocks, raw, slopes, held, strict=True)
        )
        pulled = best.residuals.pulled
        return cls(problem=problem, rows=rows, given=deviance_of(best), pulled=pulled)

    @cached_property
    def given_from_scene(self) -> float:
        """Gain of the files as they stand, fitted as the other readings are: what curvature takes."""
        return self.gain((), ()) or 0.0

    def gain(self, joint: Joint, chosen: Sequence[int]) -> float | None:
        """Of the log likelihood, by reading some files otherwise; None where nothing can be predicted."""
        rows = list(self.rows)
        for i in chosen:
            changed = self._changed(joint, i)
            if changed is None:
                return None
            rows[i] = changed
        problem = replace(self.problem, blocks=tuple(r.block for r in rows))
        found = min(self._deviance(problem, rows, t) for t in self._starts(problem, rows))
        gain = (self.given - found) / 2 + self.jacobian(joint, chosen)
        return gain if math.isfinite(gain) else None

    def jacobian(self, joint: Joint, chosen: Sequence[int]) -> float:
        """ln |dy'/dy|."""
        size = sum(self.rows[i].block.measured.size for i in chosen)
        return size * sum(math.log(each.scale) for each in joint)

    def refitted(self, joint: Joint, chosen: Sequence[int], scene: Any) -> float:
        """The gain by a fit from the scene as stated; minus infinity where there is none.

        The scene to which wrong readings pull held inputs is far from where another reading has them.
        """
        blocks = list(self.problem.blocks)
        for i in chosen:
            for each in joint:
                changed = each.change(blocks[i].observations, scene)
                blocks[i] = Block(observations=changed) if changed is not None else blocks[i]
        problem = replace(self.problem, scene=scene, blocks=tuple(blocks))
        try:
            best, _ = optimum_as_stated(problem, loss="linear", starts=1)
        except (FitError, ValueError):
            return -math.inf
        return (self.given - deviance_of(best)) / 2 + self.jacobian(joint, chosen)

    @cached_property
    def _response(self) -> tuple[int, int] | None:
        """Places of influence coefficient and lag; None where predictions are not in proportion to them."""
        places = [_place(self.problem, name) for name in ("influence_coefficient", "lag_angle")]
        kappa, lag = places
        if kappa is None or lag is None:
            return None
        others = [rows.slopes[:, [kappa, lag]] for rows in self.rows if not rows.vibration]
        return None if any(map(np.any, others)) else (kappa, lag)

    def _starts(self, problem: Problem, rows: Sequence[_Rows]) -> Iterator[FloatArray]:
        """t of the scene, and with the influence coefficient that explains the vibrations best."""
        yield problem.start
        if self._response is None:
            return
        whole = np.concatenate([np.full(each.block.measured.size, each.vibration) for each in rows])
        sides = [
            np.concatenate([each.block.whiten @ each.times(factor).predicted for each in rows])
            for factor in (1, 1j)
        ]
        columns = np.column_stack([*sides, problem.free])[whole]
        scales = np.linalg.norm(columns, axis=0)
        if np.all(scales[:2] > 0):
            scales[scales == 0] = 1.0
            real, imaginary, *_ = np.linalg.lstsq(columns / scales, problem.measured[whole])[0] / scales
            yield self._moved(problem.start, complex(real, imaginary))

    def _moved(self, t: FloatArray, factor: complex) -> FloatArray:
        """t at another influence coefficient."""
        moved, places = t.copy(), self._response
        if places is not None and factor != 0:
            moved[list(places)] += math.log(abs(factor)), -cmath.phase(factor)
        return moved

    def _deviance(self, problem: Problem, rows: Sequence[_Rows], t: FloatArray) -> float:
        """-2 ln L, linear in all but the response of the rotor."""
        deviance = math.inf
        for _ in range(_STEPS):
            factor = 1.0 + 0j
            if self._response is not None:
                kappa, lag = (t - problem.start)[list(self._response)]
                factor = cmath.exp(complex(kappa, -lag))
            there = [each.times(factor) for each in rows]
            linear = _Linear.at(
                problem,
                t,
                np.concatenate([r.block.whiten @ r.predicted for r in there]),
                np.concatenate([r.block.whiten @ r.slopes for r in there]),
                np.concatenate([r.block.whiten @ r.held for r in there]),
                pulled=self.pulled,
            )
            settled = linear.settled()
            deviance = settled.deviance
            if self._response is None or not math.isfinite(deviance):
                break
            step = 1 + complex(*(settled.step[list(self._response)] * (1, -1)))
            if abs(step - 1) < _CLOSE:
                break
            t = self._moved(t, step)
        return deviance

    @cached_property
    def _read(self) -> dict[tuple[int, tuple[str, ...]], _Rows | None]:
        return {}

    def _changed(self, joint: Joint, i: int) -> _Rows | None:
        """Rows of a file that is read otherwise, as far as it can be."""
        observations = self.rows[i].block.observations
        able: list[Misreading] = []
        for each in joint:
            changed = each.change(observations, self.problem.scene)
            if changed is not None:
                observations, able = changed, [*able, each]
        settings = tuple(each.code for each in able if each.settings)
        if (i, settings) not in self._read:
            self._read[i, settings] = self._predicted(observations, self.rows[i], alike=not settings)
        rows = self._read[i, settings]
        return None if rows is None else replace(rows, block=Block(observations=observations))

    def _predicted(self, observations: Observations, rows: _Rows, *, alike: bool) -> _Rows | None:
        """By what the reading has been set to; None where nothing can be predicted of it."""
        if alike:
            return rows
        problem, block = self.problem, Block(observations=observations)
        alone = replace(problem, blocks=(block,))
        try:
            predicted = _unwhitened(alone, alone.at(problem.start)[:, None])[0][:, 0]
            slopes = _unwhitened(alone, alone.quick_slopes(problem.start))[0]
        except ValueError:
            return None
        held = _in_proportion(block, rows, predicted)
        return _Rows(block=block, predicted=predicted, slopes=slopes, held=held)


def deviance_of(best: Optimum) -> float:
    """-2 ln L at an optimum."""
    problem, of = best.residuals.problem, best.of_prediction
    there, held, pulled = problem.at(best.t), best.residuals.held, best.residuals.pulled
    return _Linear.at(problem, best.t, there, of, held, pulled=pulled).settled().deviance


def _in_proportion(block: Block, rows: _Rows, predicted: FloatArray) -> FloatArray:
    """Effects of held inputs, turned and stretched with the prediction of each row."""
    count = len(block.observations)
    if predicted.size == count:
        ratio = np.divide(predicted, rows.predicted, out=np.zeros(count), where=rows.predicted != 0)
        return np.asarray(ratio[:, None] * rows.held)
    before, after = (v[:count] + 1j * v[count:] for v in (rows.predicted, predicted))
    turn = np.divide(after, before, out=np.zeros(count, dtype=np.complex128), where=before != 0)
    moved = turn[:, None] * (rows.held[:count] + 1j * rows.held[count:])
    return np.concatenate([moved.real, moved.imag])


def _unwhitened(problem: Problem, values: FloatArray) -> list[FloatArray]:
    """Columns of numbers, file by file, before L^-1."""
    parts = np.split(values, np.cumsum([b.measured.size for b in problem.blocks])[:-1])
    return [np.asarray(np.linalg.solve(b.whiten, p)) for b, p in zip(problem.blocks, parts, strict=True)]


def _place(problem: Problem, name: str) -> int | None:
    names = [each.name.rpartition(".")[2] for each in problem.parameters]
    return names.index(name) if name in names else None


def passive(lag: float) -> bool:
    """Whether a lag, rad, is one that a passive rotor can have: from 0 to 180 degrees."""
    return lag % (2 * math.pi) <= math.pi


@dataclass(frozen=True, kw_only=True, eq=False)
class _Settled:
    """A linear problem solved."""

    deviance: float
    """-2 ln L."""
    step: FloatArray
    """Unknowns."""
    width: FloatArray
    """Their standard deviations."""
    spread: FloatArray
    """Squares of the residuals of each estimated group."""
    freedom: FloatArray
    """Degrees of freedom of these."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Linear:
    """A problem that is linear around one t."""

    problem: Problem
    apart: FloatArray
    """L^-1 (y - f), shape (n,)."""
    design: FloatArray
    """Slopes by parameters, b and held inputs, shape (n, unknowns)."""
    known: FloatArray
    """What is known beforehand of the unknowns, one standard deviation a row; with its residuals."""
    known_apart: FloatArray
    t: FloatArray

    @classmethod
    def at(
        cls,
        problem: Problem,
        t: FloatArray,
        predicted: FloatArray,
        slopes: FloatArray,
        held: FloatArray,
        *,
        pulled: FloatArray,
    ) -> _Linear:
        design = np.hstack([slopes, problem.free, held])
        rows = [(i, *_known(problem, i, float(t[i]))) for i in range(t.size)]
        known = np.zeros((t.size + held.shape[1], design.shape[1]))
        for i, slope, _ in rows:
            known[i, i] = slope
        known[t.size :, design.shape[1] - held.shape[1] :] = np.eye(held.shape[1])
        apart = np.concatenate([[-off for _, _, off in rows], -pulled])
        return cls(
            problem=problem,
            apart=problem.measured - predicted,
            design=design,
            known=known,
            known_apart=apart,
            t=t,
        )

    def settled(self) -> _Settled:
        """The noise settled; an infinite deviance where a group has no freedom left."""
        group, count = self.problem.group, len(self.problem.estimated_groups)
        sizes = np.array([_size(self.problem.measured[group == g]) for g in range(count)])
        noise = np.array([_size(self.apart[group == g]) for g in range(count)])
        noise = np.maximum(noise, _LEAST_NOISE * sizes)
        for _ in range(_ROUNDS):
            found = self._solved(noise)
            if np.any(found.freedom < 0.5):
                return replace(found, deviance=math.inf)
            settled = np.maximum(noise * np.sqrt(found.spread / found.freedom), _LEAST_NOISE * sizes)
            done = np.max(np.abs(settled / noise - 1), initial=0.0) < _AGREES
            noise = settled
            if done:
                break
        whitening = sum(float(np.sum(np.log(np.diag(b.whiten)))) for b in self.problem.blocks)
        passive = math.log(max(self._chance_of_passive(found), _LEAST_CHANCE))
        return replace(found, deviance=found.deviance - 2 * whitening - 2 * passive)

    def _chance_of_passive(self, found: _Settled) -> float:
        """Probability that the lag lies between 0 and 180 degrees; 1 of a lag that is not fitted, or that the
        scene has outside."""
        i = _place(self.problem, "lag_angle")
        if i is None or not passive(self.problem.parameters[i].start):
            return 1.0
        lag = (float(self.t[i] + found.step[i]) + math.pi / 2) % (2 * math.pi) - math.pi / 2
        freedom = min(
            (
                float(found.freedom[self.problem.estimated_groups.index(b.group)])
                for b in self.problem.blocks
                if b.estimated and b.measured.size == 2 * len(b.observations)
            ),
            default=math.inf,
        )
        nearer = min(lag, math.pi - lag)
        inside, beyond = stdtr(min(freedom, 1e9), np.array([nearer, nearer - math.pi]) / found.width[i])
        return float(inside - beyond)

    def _solved(self, noise: FloatArray) -> _Settled:
        """With the noise given; the deviance without what whitening adds."""
        group = self.problem.group
        s = np.where(group < 0, 1.0, noise[group]) if noise.size else np.ones(group.size)
        whole = np.concatenate([self.design / s[:, None], self.known])
        left = np.concatenate([self.apart / s, self.known_apart])
        base, triangle = np.linalg.qr(whole)
        along = base.T @ left
        rest = left - base @ along
        taken, n = np.sum(base[: group.size] ** 2, axis=1), group.size
        sizes = np.maximum(np.abs(np.diag(triangle)), 1e-12)
        logs = 2 * float(np.sum(np.log(s))) + 2 * float(np.sum(np.log(sizes)))
        inverse = np.linalg.pinv(triangle)
        return _Settled(
            deviance=float(rest @ rest) + logs,
            step=inverse @ along,
            width=np.linalg.norm(inverse, axis=1),
            spread=np.array([np.sum(rest[:n][group == g] ** 2) for g in range(noise.size)]),
            freedom=np.array([np.sum(1 - taken[group == g]) for g in range(noise.size)]),
        )


def _known(problem: Problem, i: int, t: float) -> tuple[float, float]:
    """Of one parameter: 1/standard deviation in t of what is known beforehand, and how far t is off it."""
    parameter, start = problem.parameters[i], float(problem.start[i])
    if parameter.prior:
        return parameter.slope(t) / parameter.prior, (parameter.value(t) - parameter.start) / parameter.prior
    return 1 / _WIDE, (t - start) / _WIDE


def _size(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) or 1e-300
