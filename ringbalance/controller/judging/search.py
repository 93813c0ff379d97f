"""Settings by runs: levels on the axes that a balancer offers, raced over few drawn devices.

The fraction of devices that a setting serves changes by steps of one device, without a gradient to follow:
coarse levels come first, then the neighbours of the best until all of these are tried.  Settings that are
significantly worse than the best on the same devices are dropped after few.  More devices choose between the
last few settings; other devices judge the choice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from ringbalance.controller.balancer import Balancer, Draws, Settings
from ringbalance.controller.judging.candidates import (
    DEVICES,
    SearchPoint,
    Tried,
    chosen,
    is_decided,
    is_worse,
)
from ringbalance.controller.judging.judge import Judgement
from ringbalance.controller.trials import SearchAxis, Trials
from ringbalance.scene.origins import value_at

Progress = Callable[[str], None]

_HEATS: Final = ((0, 8), (8, 16), (16, DEVICES))
"""Devices of the heats of a race: first number, and the number after the last."""
_FINAL: Final = (DEVICES, 4 * DEVICES)
"""Devices that choose between the last few settings: first number, and the number after the last."""
_FINALISTS: Final = 8
_CLEAR_FINALISTS: Final = 3
"""Finalists where the best serve enough of the first devices: they distinguish the middle of a plateau from
its edge."""
_GOOD_FRACTION: Final = 0.9
"""Fraction of the devices that the best settings must serve to end the wider search."""
_WIDE_ROUNDS: Final = 6
_ALONG: Final = 3
"""Rounds at a level of the scan axis, from the best of a neighbouring level."""
_SCAN_DRAWS: Final = tuple(
    Draws.block(256 + first, count, complete=False) for first, count in ((0, 16), (16, 48))
)
"""Devices that judge the levels of a scan, apart from those of the choice and of the verdict; the second
block runs only at levels that serve a device of the first."""


_Ran = dict[object, Tried | None]
"""Evaluated candidates by key; None: dropped before every device had run."""


def search(
    balancer: Balancer,
    trials: Sequence[Trials],
    *,
    level: float | None = None,
    ran: Mapping[str, _Ran] | None = None,
    progress: Progress,
) -> tuple[Tried, ...]:
    """The best candidate of every kind of controller, the recommended kind first.

    Args: `level`: on `Trials.scan_axis`; default the scene's. `ran`: candidates already run at that level, by
        kind.
    """
    winners: list[Tried] = []
    for space in trials:
        evaluated = dict((ran or {}).get(space.kind, {}))
        _climb(balancer, evaluated, _coarse(space, level), rounds=_WIDE_ROUNDS, wide=True, progress=progress)
        served = [each for each in evaluated.values() if each]
        best = chosen(served)
        if best is not None and best.count:
            # 32 of 32 devices are no proof of 0.9: more devices choose between the finalists.
            if best.fraction < _GOOD_FRACTION:
                finalists = sorted(served, key=lambda each: (-each.count, each is not best))[:_FINALISTS]
            else:
                finalists, others = [best], [each for each in served if each is not best]
                while len(finalists) < _CLEAR_FINALISTS and (following := chosen(others)) and following.count:
                    finalists.append(following)
                    others.remove(following)
            best = chosen(_on_more(balancer, finalists))
        winners += filter(None, [best])
    return _ordered(winners, trials)


def _ordered(best: Iterable[Tried], trials: Sequence[Trials]) -> tuple[Tried, ...]:
    """The best candidate of every kind of controller, the recommended kind first."""
    every = tuple(best)
    scenes = next((each for each in every if each.candidate.trials.kind == trials[0].kind), None)

    def order(each: Tried) -> tuple[bool, bool, float]:
        return scenes is not None and not each.replaces(scenes), each is not scenes, -each.fraction

    return tuple(sorted(every, key=order))


def _coarse(trials: Trials, level: float | None) -> list[SearchPoint]:
    return [SearchPoint(trials=trials, places=each, level=level) for each in trials.first]


def _climb(
    balancer: Balancer,
    tried: _Ran,
    field: list[SearchPoint],
    *,
    rounds: int,
    wide: bool,
    other: Tried | None = None,
    progress: Progress,
) -> None:
    """Add the results of a field, and repeatedly those of the neighbours of the best.

    Args: `wide`: continue from the best even if it serves no device; if it serves too few, also from the best
        of those that are not next to it. `other`: the best of another kind of controller; candidates that are
        significantly worse are dropped.
    """
    for _ in range(rounds):
        if not (fresh := [each for each in field if each.key not in tried]):
            break
        progress(f"{len(fresh)} settings, {fresh[0].trials.kind.replace('_', ' ')}")
        earlier = [each for each in (*tried.values(), other) if each]
        ran = _raced(balancer, fresh, leading=max(earlier, key=lambda each: each.fraction, default=None))
        tried |= {each.key: None for each in fresh} | {each.candidate.key: each for each in ran}
        served = [each for each in tried.values() if each]
        best = chosen(served)
        starts = [best] if best is not None and (best.count or wide) else []
        if best is not None and wide and best.fraction < _GOOD_FRACTION:
            apart = [each for each in served if not each.candidate.is_beside(best.candidate)]
            starts += filter(None, [chosen(apart)])
        field = [near for each in starts for near in each.candidate.neighbours()]


def _on_more(balancer: Balancer, tried: Sequence[Tried]) -> list[Tried]:
    """Add the outcomes of the devices that choose between the last few settings."""
    first, end = _FINAL
    settings = [each.judgement.settings for each in tried]
    ran = balancer.run_all(settings, Draws.block(first, end - first, complete=False))
    return [each.joined(outcomes) for each, outcomes in zip(tried, ran, strict=True)]


def _raced(balancer: Balancer, field: Sequence[SearchPoint], *, leading: Tried | None = None) -> list[Tried]:
    """Drop candidates that are significantly worse than the best. Args: `leading`: best of earlier ones."""
    running: dict[int, Tried | None] = {i: None for i, each in enumerate(field) if each.settings is not None}
    for first, last in _HEATS:
        if not running:
            break
        settings = [field[i].settings or {} for i in running]
        ran = balancer.run_all(settings, Draws.block(first, last - first, complete=False))
        for i, outcomes in zip(running, ran, strict=True):
            before = running[i]
            judgement = Judgement.of(balancer, field[i].settings or {}, outcomes)
            running[i] = before.joined(outcomes) if before else Tried(candidate=field[i], judgement=judgement)
        ranked = [each.judgement.meets for each in (*running.values(), leading) if each]
        best = max((meets[:last] for meets in ranked), key=np.count_nonzero)
        if not best.any():
            # None serves a device: one of them is enough to show the cause.
            return [each for each in running.values() if each][:1]
        running = {i: each for i, each in running.items() if each and not is_worse(each, best)}
    return [each for each in running.values() if each]


@dataclass(frozen=True, kw_only=True, eq=False)
class ScanLevel:
    """The best settings at one level of an axis, over devices that they were not chosen on."""

    level: float
    judgement: Judgement

    @property
    def usable_moment(self) -> tuple[float, float, float]:
        """Usable moment of the devices, kg m: quantiles of 10 %, 50 % and 90 %."""
        low, middle, high = np.quantile(self.judgement.outcomes.usable_moment, [0.1, 0.5, 0.9])
        return float(low), float(middle), float(high)


def scanned(
    balancer: Balancer, trials: Sequence[Trials], winners: Sequence[Tried], *, progress: Progress
) -> tuple[tuple[ScanLevel, ...], Sequence[Tried]]:
    """The best settings at the levels of an axis, with more levels until both neighbours of the best are
    among them; both results are empty where there is no axis.

    The recommended level is searched as widely as the scene's, and then the others again from its settings,
    so that the result does not depend on the level at which the search began.
    Args: `winners`: the best candidate of every kind of controller at the scene's own level.
    """
    axis = trials[0].scan_axis
    if axis is None:
        return (), ()
    level = value_at(balancer.scene, axis.name)
    nearest = min(range(len(axis.levels)), key=lambda at: abs(axis.levels[at] - level))
    searched = {nearest: winners} if axis.levels[nearest] == level else {}
    levels = _Levels(balancer=balancer, trials=trials, axis=axis, searched=searched)
    answered: dict[int, ScanLevel] = {}
    places: Sequence[int] = axis.first
    levels.add(sorted(places, key=lambda at: abs(at - nearest)))
    if levels.top is not None:
        levels.search(levels.top, progress)
    while True:
        levels.add(sorted(places, key=lambda at: abs(at - nearest)))
        progress(f"{len(answered)} levels of {axis.name}")
        answered |= levels.answered(answered)
        top = _top({at: each.judgement.fraction.count for at, each in answered.items()})
        served = answered[top].judgement.fraction.count > 0
        next_places = (top - 1, top + 1) if served else (min(answered) - 1, max(answered) + 1)
        places = [at for at in next_places if at not in answered and 0 <= at < len(axis.levels)]
        if not places:
            if top in levels.searched or not served:
                break
            levels.search(top, progress)
    return tuple(answered[at] for at in sorted(answered)), levels.searched.get(top, ())


@dataclass(frozen=True, kw_only=True, eq=False)
class _Levels:
    """Settings that serve devices at the levels of an axis."""

    balancer: Balancer
    trials: Sequence[Trials]
    axis: SearchAxis
    searched: dict[int, Sequence[Tried]]
    """The best candidates of all kinds of controller at widely searched levels, by index of the level."""
    ran: dict[int, dict[str, _Ran]] = field(default_factory=dict)
    """Candidates that ran at the other levels, by index of the level and kind of controller."""
    serving: dict[int, dict[str, Tried]] = field(default_factory=dict)
    """The best candidates that serve any device at the other levels, by index of the level and kind."""
    more: dict[object, Tried] = field(default_factory=dict)
    """The best candidates of the kinds on more devices, by key, where those of the search do not decide."""

    def add(self, places: Sequence[int]) -> None:
        """Search levels from the best settings of the nearest one, then from those of both neighbours."""
        for at in places:
            for trials in self.trials:
                self._climb(at, trials, self._nearest(at, trials.kind))
        evaluated = self._evaluated
        for before, at in (*pairwise(evaluated), *pairwise(reversed(evaluated))):
            for trials in self.trials:
                if trials.kind in self._serving(before):
                    self._climb(at, trials, before)

    def search(self, at: int, progress: Progress) -> None:
        """Search a level as widely as the scene's."""
        if at not in self.searched:
            level, ran = self.axis.levels[at], self.ran.get(at)
            self.searched[at] = search(self.balancer, self.trials, level=level, ran=ran, progress=progress)

    @property
    def top(self) -> int | None:
        """Index of the level that serves most of the devices of the search; None: none serves any."""
        best = {at: chosen(self._serving(at).values()) for at in self._evaluated}
        counts = {at: each.fraction * DEVICES for at, each in best.items() if each}
        return _top(counts) if counts else None

    @property
    def _evaluated(self) -> list[int]:
        return sorted({*self.searched, *self.ran})

    def _serving(self, at: int) -> dict[str, Tried]:
        """The best candidates at a level by kind of controller, of the kinds that serve any device."""
        widely = {each.candidate.trials.kind: each for each in self.searched.get(at, ()) if each.count}
        return widely if at in self.searched else self.serving.get(at, {})

    def _nearest(self, at: int, kind: str) -> int | None:
        """Index of the nearest level at which a kind of controller serves any device; None: there is none."""
        serving = (each for each in self._evaluated if kind in self._serving(each))
        return min(serving, key=lambda each: abs(each - at), default=None)

    def _climb(self, at: int, trials: Trials, near: int | None) -> None:
        """Search a level from the best settings of level `near`; None: from the coarse levels of the axes."""
        level, kind = self.axis.levels[at], trials.kind
        if at in self.searched or (trials is not self.trials[0] and self._needless(at, kind, near)):
            return
        ran, serving = self.ran.setdefault(at, {}).setdefault(kind, {}), self.serving.setdefault(at, {})
        before = serving.get(kind)
        start = (
            _coarse(trials, level)
            if near is None
            else [replace(self._serving(near)[kind].candidate, level=level)]
        )
        climb = partial(_climb, self.balancer, ran, wide=False, progress=lambda _: None)
        climb(start, rounds=1, other=chosen(serving.values()))
        best = chosen(each for each in ran.values() if each)
        if best is None or best.count <= (before.count if before else 0):
            return
        serving[kind] = best
        for each in self.trials[1:] if trials is self.trials[0] else ():
            # Where the other kinds serve more, significantly worse neighbours are dropped after few devices.
            self._climb(at, each, self._nearest(at, each.kind))
        climb(best.candidate.neighbours(), rounds=_ALONG - 1, other=chosen(serving.values()))
        serving[kind] = chosen(each for each in ran.values() if each) or best

    def _needless(self, at: int, kind: str, near: int | None) -> bool:
        """True if a kind of controller other than the scene's need not be tried at a level.

        Either the scene's kind serves enough there; or it serves too few from level `near` to this one, and
        at `near` the other kind does not replace it.
        """
        required, scenes_kind = self.balancer.required_fraction(), self.trials[0].kind
        evaluated = self._evaluated
        serving = ((each, self._serving(each)) for each in evaluated)
        fractions = {each: best[scenes_kind].fraction for each, best in serving if scenes_kind in best}
        if near is None or fractions.get(at, 0.0) >= required:
            return fractions.get(at, 0.0) >= required
        best_there = self._compared(near)
        no_more = scenes_kind in best_there and not best_there[kind].replaces(best_there[scenes_kind])
        between = (each for each in evaluated if min(at, near) <= each <= max(at, near))
        return no_more and all(fractions.get(each, 0.0) < required for each in between)

    def answered(self, before: Mapping[int, ScanLevel]) -> dict[int, ScanLevel]:
        """Judge levels on the devices of the scan, except those already judged under the same settings."""
        settings: dict[int, Settings] = {}
        for at in self._evaluated:
            level = self.axis.levels[at]
            best = _ordered(self._compared(at).values(), self.trials)
            at_level = replace(best[0].candidate, level=level).settings if best else None
            chosen_settings = at_level or {self.axis.name: level}
            if at not in before or before[at].judgement.settings != chosen_settings:
                settings[at] = chosen_settings
        judgements: dict[int, Judgement] = {}
        pending = list(settings)
        for draws in _SCAN_DRAWS:
            if not pending:
                break
            ran = self.balancer.run_all([settings[at] for at in pending], draws)
            for at, outcomes in zip(pending, ran, strict=True):
                new = Judgement.of(self.balancer, settings[at], outcomes)
                judgements[at] = judgements[at].extended(outcomes) if at in judgements else new
            # The first devices are enough where none of them is served.
            pending = [at for at in pending if judgements[at].fraction.count]
        return {at: ScanLevel(level=self.axis.levels[at], judgement=each) for at, each in judgements.items()}

    def _compared(self, at: int) -> dict[str, Tried]:
        """Best of every kind at a level, on more devices where those of the search leave the kind open."""
        serving = self._serving(at)
        if at not in self.searched and not is_decided(serving.values()):
            near = [each for each in serving.values() if each.candidate.key not in self.more]
            self.more.update((each.candidate.key, each) for each in _on_more(self.balancer, near))
            return {kind: self.more[each.candidate.key] for kind, each in serving.items()}
        return serving


def _top(count: Mapping[int, float]) -> int:
    """Index of the level to recommend: at most one device below the best, with most devices around it."""
    near = {at: sum(count.get(at + by, 0) for by in (-1, 0, 1)) for at in count}
    most = max(count.values())
    return max((at for at in count if count[at] >= most - 1), key=lambda at: (near[at], count[at]))


def searched(
    balancer: Balancer, *, level: float | None = None, progress: Progress = lambda _: None
) -> Settings:
    """The best settings; empty where there are none to try. Args: `level`: as in `search`."""
    offered = balancer.trials()
    if level is None and not any(each.axes for each in offered):
        return {}
    winners = search(balancer, offered, level=level, progress=progress)
    return (winners[0].candidate.settings if winners else None) or {}
