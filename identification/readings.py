"""Other readings of the data: columns exchanged, angles the other way round, units that are mixed up.

A wrong reading seldom leaves a pattern in the residuals: the noise is estimated and takes what the prediction
does not explain.  So every file is read otherwise too, and the likelihoods of both readings are compared,

    -2 ln L = sum (e/s)^2 + priors + 2 sum n_g ln s_g + ln det A'A - 2 ln det L^-1 - 2 ln |dy'/dy|,

restricted to what parameters, held inputs and free unknowns leave (A their slopes), the noise of each group
estimated again, y' what was measured as the other reading has it.  The other reading is fitted linearly from
the scene, so that it loses a little by curvature; the given one from its optimum.  Both know that lambda
follows from the geometry: without that, peak to peak in one file is a lambda of two.  A reading is named from
a gain of `_DECISIVE` on: of thirty, and one file in a hundred read wrongly, odds of 100 to 1 are left.
Source: restricted likelihood, Harville, J. Am. Stat. Assoc. 72 (1977) 320; slopes of held inputs in
proportion to the prediction are ours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.controller.rotor import chamber_letters
from ringbalance.identification.kinds.kind import Column, Observations
from ringbalance.identification.likelihood import Block, Problem
from ringbalance.identification.optimisation import Optimum
from ringbalance.results.rows import text_of
from ringbalance.scene.arrays import FloatArray

_FAR: Final = 5.0
"""Ratio of a column's median to the nearer end of the scene's range: below the ten of the smallest mistake of
a unit, and beyond what a test rig changes."""
_FAR_VIBRATION: Final = 100.0
"""The same of vibrations, which the scene seldom knows better."""


@dataclass(frozen=True, kw_only=True)
class ComparedColumn:
    """One column of one file."""

    file: str
    column: str
    unit: str
    """Of the template; empty for a number without one."""
    ratio: float
    """Median of the column over the nearer end of the scene's range; one within it."""
    fails: bool
    """Whether it lies so far off that a unit is wrong, or the machine another one."""
    text: str


def compared_columns(problem: Problem) -> Iterator[ComparedColumn]:
    """Columns against what the scene has."""
    for block in problem.blocks:
        observations = block.observations
        ranges = block.kind.ranges(problem.scene)
        for column in block.kind.columns:
            values, known = observations.columns.get(column.name), ranges.get(column.name)
            if values is None or known is None or not np.any(values):
                continue
            low, high = known
            middle = float(np.median(np.abs(values[values != 0])))
            ratio = middle / high if middle > high else middle / low if middle < low else 1.0
            limit = _FAR_VIBRATION if column.amplitude else _FAR
            yield ComparedColumn(
                file=observations.file,
                column=column.name,
                unit=column.unit,
                ratio=ratio,
                fails=not 1 / limit <= ratio <= limit,
                text=_text(observations.file, column, middle, ratio),
            )


def _text(file: str, column: Column, middle: float, ratio: float) -> str:
    here = {"column": column.head, "file": Path(file).name, "middle": column.written(middle)}
    if ratio == 1.0:
        return text_of("column_as_in_scene", **here)
    return text_of("column_off_scene", **here, ratio=ratio, known=column.written(middle / ratio))


_LONGEST_TIME: Final = 10.0
"""s, of an injection: seconds are looked for where milliseconds stand, and not hours."""
Change = Callable[[Observations, Any], Observations | None]
"""Takes the scene, too, which kinds of one balancer alone ask for a value of that balancer."""


@dataclass(frozen=True, kw_only=True)
class _Misreading:
    """One way to misread a file."""

    words: str
    change: Change
    settings: bool
    """Whether it changes what was set, and so what is predicted."""
    scale: float = 1.0
    """dy'/dy."""
    column: str = ""
    """That it changes, where the scene has a range of it."""
    together: bool = True
    """Whether all files may have been misread alike."""


def _exchanged(observations: Observations, _: Any) -> Observations | None:
    """Columns of before and after, with their uncertainties."""
    if observations.kind != "injection":
        return None
    other = {"before": "after", "after": "before"}

    def swapped(values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        named = {n: n.rsplit("_", 1) for n in values}
        return {
            f"{named[n][0]}_{other[named[n][1]]}" if named[n][-1] in other else n: v
            for n, v in values.items()
        }

    return replace(
        observations,
        columns=swapped(observations.columns),
        uncertainty=swapped(observations.uncertainty),
    )


def _turned(*names: str) -> Change:
    """Angles of these names with the other sign."""

    def change(observations: Observations, _: Any) -> Observations | None:
        chosen = {n: -v for n, v in observations.columns.items() if n.startswith(names)}
        vibration = any(n.startswith("phase") for n in observations.columns)
        return observations.with_columns(**chosen) if chosen and vibration else None

    return change


def _lettered(observations: Observations, scene: Any) -> Observations | None:
    """Chambers counted against the rotation from A."""
    if observations.kind != "injection" or scene.disc.chambers < 4:
        return None
    letters = chamber_letters(scene.disc.chambers)
    count = len(letters)
    numbers = [letters.index(letter) for letter in observations.chamber]
    return replace(observations, chamber=np.array([letters[-i % count] for i in numbers]))


def _amplitudes(factor: float) -> Change:
    def change(observations: Observations, _: Any) -> Observations | None:
        columns = {n: factor * v for n, v in observations.columns.items() if n.startswith("amplitude")}
        widths = {n: factor * v if n in columns else v for n, v in observations.uncertainty.items()}
        return replace(observations.with_columns(**columns), uncertainty=widths) if columns else None

    return change


def _pressures(factor: float, *, absolute: bool = False) -> Change:
    """Of the gas, in another unit, or less that of the surroundings."""

    def change(observations: Observations, scene: Any) -> Observations | None:
        if observations.kind not in ("injection", "transfer"):
            return None
        gauge = factor * observations.columns["pressure"]
        gauge = gauge - scene.gas.ambient_pressure if absolute else gauge
        return observations.with_columns(pressure=gauge) if np.all(gauge > 0) else None

    return change


def _seconds(observations: Observations, _: Any) -> Observations | None:
    if observations.kind not in ("injection", "transfer"):
        return None
    times = 1e3 * observations.columns["gas_time"]
    return observations.with_columns(gas_time=times) if np.median(times) < _LONGEST_TIME else None


_MISREADINGS: Final[Mapping[str, _Misreading]] = {
    "before_and_after_exchanged": _Misreading(
        words="vibrations before and after exchanged", change=_exchanged, settings=False, together=False
    ),
    "phases_turned": _Misreading(
        words="phases with the other sign, against the rotation", change=_turned("phase"), settings=False
    ),
    "weights_turned": _Misreading(
        words="angles of the trial weights against the rotation", change=_turned("angle"), settings=True
    ),
    "chambers_turned": _Misreading(
        words="chambers lettered against the rotation", change=_lettered, settings=True
    ),
    "amplitudes_halved": _Misreading(
        words="amplitudes half as large, such as peak to peak stated as zero to peak",
        change=_amplitudes(0.5),
        settings=False,
        scale=0.5,
    ),
    "amplitudes_doubled": _Misreading(
        words="amplitudes twice as large, such as zero to peak stated as peak to peak",
        change=_amplitudes(2.0),
        settings=False,
        scale=2.0,
    ),
    "pressures_tenth": _Misreading(
        words="gas pressures a tenth as large, such as bar stated as MPa",
        change=_pressures(0.1),
        settings=True,
        column="pressure",
    ),
    "pressures_tenfold": _Misreading(
        words="gas pressures ten times as large, such as MPa stated as bar",
        change=_pressures(10.0),
        settings=True,
        column="pressure",
    ),
    "pressures_absolute": _Misreading(
        words="gas pressures as absolute ones, less that of the surroundings",
        change=_pressures(1.0, absolute=True),
        settings=True,
        column="pressure",
    ),
    "times_in_seconds": _Misreading(
        words="valve-open times a thousand times as long, such as seconds stated as milliseconds",
        change=_seconds,
        settings=True,
        column="gas_time",
    ),
}
"""By code."""


_DECISIVE: Final = math.log(1e6)
"""Gain of the log likelihood."""
_ROUNDS: Final = 12
_AGREES: Final = 1e-2
_LEAST_NOISE: Final = 1e-6
"""Of the root mean square of what a group measured."""
_GEOMETRY: Final = 0.05
"""Standard deviation of ln lambda, where the scene states none."""
_WIDE: Final = 1.0
"""The same of other parameters, in their own scales."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Files read in another way."""

    code: str
    files: tuple[str, ...]
    gain: float
    """Of the log likelihood, over that of the files as they stand."""
    named: bool
    """Whether it fits decisively better, and better than all others of the same files."""
    text: str


def other_readings(best: Optimum, ranges: Sequence[ComparedColumn] = ()) -> tuple[Reading, ...]:
    """Every other reading of the data, the likeliest first.

    Args: `ranges`: columns compared with the scene. Where those that a reading changes are far from it in all
        of its files, it is named from the first gain on: a free loss takes up a pressure ten times too large.
    """
    compare, far = _Comparison.of(best), {(each.file, each.column) for each in ranges if each.fails}
    tried = [
        (code, chosen, compare.gain(kind, chosen))
        for code, kind in _MISREADINGS.items()
        for chosen in _choices(compare.problem, kind)
    ]
    gains = sorted(
        ((gain, code, chosen) for code, chosen, gain in tried if gain is not None),
        key=lambda each: -each[0],
    )
    return tuple(
        _reading(
            compare.problem,
            code,
            chosen,
            gain,
            named=place == 0 and gain >= _asked(compare.problem, code, chosen, far),
        )
        for place, (gain, code, chosen) in enumerate(gains)
    )


def _asked(problem: Problem, code: str, chosen: Sequence[int], far: Collection[tuple[str, str]]) -> float:
    """Gain of the log likelihood from which a reading is named."""
    changed = [(problem.blocks[i].observations.file, _MISREADINGS[code].column) for i in chosen]
    return 0.0 if all(each in far for each in changed) else _DECISIVE


def _reading(problem: Problem, code: str, chosen: Sequence[int], gain: float, *, named: bool) -> Reading:
    files = tuple(problem.blocks[i].observations.file for i in chosen)
    text = text_of(
        "read_otherwise_better" if named else "read_otherwise",
        files=" and ".join(Path(file).name for file in files),
        reading=_MISREADINGS[code].words,
        gain=f"{gain:+.3g}",
    )
    return Reading(code=code, files=files, gain=gain, named=named, text=text)


def _choices(problem: Problem, kind: _Misreading) -> Iterator[tuple[int, ...]]:
    """Places of the files that are read otherwise: each that can be, and all of them."""
    able = [i for i, b in enumerate(problem.blocks) if kind.change(b.observations, problem.scene) is not None]
    yield from ((i,) for i in able)
    if kind.together and len(able) > 1:
        yield tuple(able)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Rows:
    """Numbers of one file before whitening: predicted at the start, slopes, effects of held inputs."""

    block: Block
    predicted: FloatArray
    slopes: FloatArray
    held: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class _Comparison:
    problem: Problem
    rows: tuple[_Rows, ...]
    given: float
    """-2 ln L of the files as they stand."""
    pulled: FloatArray
    """Held inputs at which predictions are made, in standard deviations."""

    @classmethod
    def of(cls, best: Optimum) -> _Comparison:
        problem, start = best.residuals.problem, best.residuals.problem.start
        raw = _unwhitened(problem, problem.at(start)[:, None])
        slopes = _unwhitened(problem, problem.quick_slopes(start))
        held = _unwhitened(problem, best.residuals.held)
        rows = tuple(
            _Rows(block=b, predicted=f[:, 0], slopes=s, held=h)
            for b, f, s, h in zip(problem.blocks, raw, slopes, held, strict=True)
        )
        pulled = best.residuals.pulled
        here = _Linear.at(
            problem, best.t, problem.at(best.t), best.of_prediction, best.residuals.held, pulled=pulled
        )
        return cls(problem=problem, rows=rows, given=here.deviance(), pulled=pulled)

    def gain(self, kind: _Misreading, chosen: Sequence[int]) -> float | None:
        """Of the log likelihood, by reading some files otherwise; None where nothing can be predicted."""
        rows, jacobian = list(self.rows), 0.0
        for i in chosen:
            changed = self._changed(kind, rows[i])
            if changed is None:
                return None
            rows[i] = changed
            jacobian += changed.block.measured.size * math.log(kind.scale)
        problem = replace(self.problem, blocks=tuple(r.block for r in rows))
        found = _Linear.at(
            problem,
            problem.start,
            np.concatenate([r.block.whiten @ r.predicted for r in rows]),
            np.concatenate([r.block.whiten @ r.slopes for r in rows]),
            np.concatenate([r.block.whiten @ r.held for r in rows]),
            pulled=self.pulled,
        ).deviance()
        gain = (self.given - found) / 2 + jacobian
        return gain if math.isfinite(gain) else None

    def _changed(self, kind: _Misreading, rows: _Rows) -> _Rows | None:
        problem = self.problem
        observations = kind.change(rows.block.observations, problem.scene)
        if observations is None:
            return None
        block = Block(observations=observations)
        if not kind.settings:
            return replace(rows, block=block)
        alone = replace(problem, blocks=(block,))
        try:
            predicted = _unwhitened(alone, alone.at(problem.start)[:, None])[0][:, 0]
            slopes = _unwhitened(alone, alone.quick_slopes(problem.start))[0]
        except ValueError:
            return None
        held = _in_proportion(block, rows, predicted)
        return _Rows(block=block, predicted=predicted, slopes=slopes, held=held)


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
        )

    def deviance(self) -> float:
        """-2 ln L, the noise settled; infinite where a group has no freedom left."""
        group, count = self.problem.group, len(self.problem.estimated_groups)
        sizes = np.array([_size(self.problem.measured[group == g]) for g in range(count)])
        noise = np.array([_size(self.apart[group == g]) for g in range(count)])
        noise = np.maximum(noise, _LEAST_NOISE * sizes)
        square, logs = math.inf, math.inf
        for _ in range(_ROUNDS):
            square, logs, spread, freedom = self._solved(noise)
            if np.any(freedom < 0.5):
                return math.inf
            settled = np.maximum(noise * np.sqrt(spread / freedom), _LEAST_NOISE * sizes)
            done = np.max(np.abs(settled / noise - 1), initial=0.0) < _AGREES
            noise = settled
            if done:
                break
        whitening = sum(float(np.sum(np.log(np.diag(b.whiten)))) for b in self.problem.blocks)
        return square + logs - 2 * whitening

    def _solved(self, noise: FloatArray) -> tuple[float, float, FloatArray, FloatArray]:
        """Sum of squares, logarithms, and of each estimated group the squares and degrees of freedom."""
        group = self.problem.group
        s = np.where(group < 0, 1.0, noise[group]) if noise.size else np.ones(group.size)
        whole = np.concatenate([self.design / s[:, None], self.known])
        left = np.concatenate([self.apart / s, self.known_apart])
        base, triangle = np.linalg.qr(whole)
        rest = left - base @ (base.T @ left)
        taken, n = np.sum(base[: group.size] ** 2, axis=1), group.size
        spread = np.array([np.sum(rest[:n][group == g] ** 2) for g in range(noise.size)])
        freedom = np.array([np.sum(1 - taken[group == g]) for g in range(noise.size)])
        sizes = np.maximum(np.abs(np.diag(triangle)), 1e-12)
        logs = 2 * float(np.sum(np.log(s))) + 2 * float(np.sum(np.log(sizes)))
        return float(rest @ rest), logs, spread, freedom


def _known(problem: Problem, i: int, t: float) -> tuple[float, float]:
    """Of one parameter: 1/standard deviation in t of what is known beforehand, and how far t is off it."""
    parameter, start = problem.parameters[i], float(problem.start[i])
    if parameter.prior:
        return parameter.slope(t) / parameter.prior, (parameter.value(t) - parameter.start) / parameter.prior
    width = _GEOMETRY if parameter.name == "lambda_factor" else _WIDE
    return 1 / width, (t - start) / width


def _size(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) or 1e-300
