"""Alternative readings of the data: exchanged columns, reversed angles, wrong units.

A wrong reading seldom leaves a pattern in the residuals: the estimated noise absorbs whatever the prediction
does not explain.  Therefore the likelihoods of alternative readings of every file are compared.

Angles are read in all senses together: phases p, trial weights w and chambers c, each with the rotation or
against it, times the factor of the amplitude.  V = V0 + kappa exp(-j lag) U with all angles conjugated is V
again, with the lag's sign changed: so p w c is the given reading with -lag, p is w c, and so on.  Only
knowledge of the lag distinguishes such two: its prior, and the fact that a passive rotor lags by 0 to 180
degrees, whose probability by the fit of the reading multiplies its likelihood.

A reading is named from a gain of `_DECISIVE` on: with thirty readings, and one file in a hundred misread,
odds of 100 to 1 remain.  Senses of angles that are less likely by less than `_TELLS` count as undecided.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.identification.likelihood import Problem
from ringbalance.identification.misreadings import (
    AMPLITUDES,
    SENSES,
    Joint,
    joint_misreadings,
    words_of,
)
from ringbalance.identification.optimisation import Optimum
from ringbalance.identification.reading_likelihood import ReadingComparison
from ringbalance.results.rows import Value, text_of

_SUSPECT_RATIO: Final = 5.0
"""Largest plausible ratio of a column's median to the nearer end of the scene's range.

It is smaller than the factor 10 of the smallest unit error, and larger than changes on a test rig.
"""
_FAR_VIBRATION: Final = 100.0
"""Largest plausible ratio for vibrations, which scenes seldom state more accurately."""


@dataclass(frozen=True, kw_only=True)
class ComparedColumn:
    """Comparison of one column of a file with the range of the scene."""

    file: str
    column: str
    unit: str
    """Unit in the template; empty for a number without one."""
    ratio: float
    """Median of the column over the nearer end of the scene's range; 1 within the range."""
    fails: bool
    """True if the ratio indicates a wrong unit or another machine."""
    text: str


def compared_columns(problem: Problem) -> Iterator[ComparedColumn]:
    """Compare columns of the files with the ranges of the scene."""
    for block in problem.blocks:
        observations = block.observations
        ranges = block.kind.ranges(problem.scene)
        for column in block.kind.columns:
            values, limits = observations.columns.get(column.name), ranges.get(column.name)
            if values is None or limits is None or not np.any(values):
                continue
            low, high = limits
            middle = float(np.median(np.abs(values[values != 0])))
            ratio = middle / high if middle > high else middle / low if middle < low else 1.0
            limit = _FAR_VIBRATION if column.amplitude else _SUSPECT_RATIO
            facts: dict[str, Value] = {
                "column": column.head,
                "file": Path(observations.file).name,
                "middle": column.written(middle),
            }
            if ratio != 1.0:
                facts |= {"ratio": ratio, "known": column.written(middle / ratio)}
            yield ComparedColumn(
                file=observations.file,
                column=column.name,
                unit=column.unit,
                ratio=ratio,
                fails=not 1 / limit <= ratio <= limit,
                text=text_of("column_as_in_scene" if ratio == 1.0 else "column_off_scene", **facts),
            )


_DECISIVE: Final = math.log(1e6)
"""Gain of the log likelihood from which on a reading is decisively better."""
_TELLS: Final = math.log(1e3)
"""Loss of the log likelihood from which on a sense of the angles is ruled out."""
_CODES: Final = {
    (True, False): "read_otherwise_better",
    (True, True): "read_one_of_several",
    (False, True): "read_undecided",
    (False, False): "read_otherwise",
}
"""Code of the sentence, by two flags of a reading: named, undecided."""
_Choice = tuple[Joint, tuple[int, ...]]
"""Combined misreadings, and indices of the files to which they apply."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Alternative reading of one or more files."""

    code: str
    """Codes of the misreadings, joined by "+"."""
    files: tuple[str, ...]
    gain: float
    """Gain of the log likelihood over that of the files as given."""
    named: bool
    """True if the reading fits decisively better, and no other reading much better still."""
    undecided: bool
    """True if the data cannot distinguish its sense of the angles from the most likely one."""
    text: str


def other_readings(
    best: Optimum,
    ranges: Sequence[ComparedColumn] = (),
    *,
    stated: Any = None,
    unexplained: Collection[str] = (),
) -> tuple[Reading, ...]:
    """Alternative readings of the data, the most likely first.

    Args: `ranges`: columns compared with the scene. If the column that a reading changes is far from the
        scene in all its files, any gain suffices: a fitted loss absorbs a pressure ten times too large.
        `stated`: scene with held inputs as stated; None: the scene of the fit. `unexplained`: files of
        which the fit explains nothing, so that no sense of their angles fits as well as another.
    """
    compare, far = ReadingComparison.of(best), {(each.file, each.column) for each in ranges if each.fails}
    problem = compare.problem
    gains = {
        (joint, chosen): gain
        for joint in joint_misreadings()
        for chosen in _choices(problem, joint)
        if (gain := compare.gain(joint, chosen)) is not None
    }
    scene = problem.scene if stated is None else stated
    # Mirrored senses differ only in the lag: the difference may be smaller than the error of linearisation.
    widest = {frozenset(joint): (joint, chosen) for joint, chosen in gains if {*joint} <= {*SENSES}}
    most = max((gains[each] for each in widest.values()), default=0.0)
    near = [each for each in widest.values() if gains[each] > most / 2]
    if most >= _DECISIVE and len(near) > 1:
        fitted = {each: compare.refitted(*each, scene) for each in near}
        gains |= {each: gain for each, gain in fitted.items() if math.isfinite(gain)}
    gains = _without_idle_factors(compare, gains, scene)
    ordered = sorted(gains.items(), key=lambda each: -each[1])
    likeliest = ordered[0][1] if ordered else 0.0
    files = [[problem.blocks[i].observations.file for i in chosen] for (_, chosen), _ in ordered]
    named = []
    for ((joint, _), gain), where in zip(ordered, files, strict=True):
        least_gain = 0.0 if all((file, joint[0].column) in far for file in where) else _DECISIVE
        named.append(gain > likeliest - _TELLS and gain >= least_gain)
    # No reading is named if a better one is not.
    named = named if any(named[:1]) else [False] * len(named)
    # The given reading, fitted linearly like the others for a fair comparison.
    least = min(compare.gain((), ()) or 0.0, 0.0) - _TELLS
    readings = []
    for ((joint, _), gain), where, is_named in zip(ordered, files, named, strict=True):
        senses_alone = not any(named) and gain > least and {*joint} <= {*SENSES}
        senses_alone = senses_alone and {*where}.isdisjoint(unexplained)
        undecided = sum(named) > 1 if is_named else senses_alone
        names = " and ".join(Path(file).name for file in where)
        words: dict[str, Value] = {"files": names, "reading": words_of(joint), "gain": f"{gain:+.3g}"}
        readings.append(
            Reading(
                code="+".join(each.code for each in joint),
                files=tuple(where),
                gain=gain,
                named=is_named,
                undecided=undecided,
                text=text_of(_CODES[is_named, undecided], **words),
            )
        )
    return tuple(readings)


def _without_idle_factors(
    compare: ReadingComparison, gains: Mapping[_Choice, float], scene: Any
) -> dict[_Choice, float]:
    """Gains without readings whose factor on the amplitude brings no decisive gain.

    The factor must improve on the sense of the angles alone; for the most likely readings also after complete
    fits of both, since linearisation about a scene that is pulled far off can err by more than the gain.
    """
    remaining = dict(gains)

    def idle(choice: _Choice, *, refitted: bool) -> bool:
        joint, chosen = choice
        alone = [(j, c) for j, c in gains if j == joint[:-1] and {*chosen} <= {*c}]
        if not refitted:
            return gains[choice] < max((gains[each] for each in alone), default=0.0) + _DECISIVE
        fitted = [compare.refitted(*each, scene) for each in (choice, *alone)]
        return fitted[0] < max(fitted[1:], default=0.0) + _DECISIVE

    for choice in gains:
        if choice[0][-1] in AMPLITUDES and idle(choice, refitted=False):
            del remaining[choice]
    for choice in sorted(remaining, key=lambda each: -remaining[each]):
        if choice[0][-1] not in AMPLITUDES or remaining[choice] < max(remaining.values()) - _TELLS:
            break
        if len(choice[0]) > 1 and idle(choice, refitted=True):
            del remaining[choice]
    return remaining


def _choices(problem: Problem, joint: Joint) -> Iterator[tuple[int, ...]]:
    """Yield indices of files for a reading: each applicable file alone, and all of them together."""
    blocks, scene = list(enumerate(problem.blocks)), problem.scene
    able = [{i for i, b in blocks if part.change(b.observations, scene) is not None} for part in joint]
    yield from ((i,) for i in sorted(set.intersection(*able)))
    every = sorted(set.union(*able))
    if all(each.together for each in joint) and all(able) and len(every) > 1:
        yield tuple(every)
