"""Remedies tried by runs: each is the balancer of the changed scene under its own best settings.

Inputs are drawn by name and number, so that a device is the same under every remedy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, Final

from ringbalance.controller.balancer import Balancer, Remedy, Settings
from ringbalance.controller.judging.judge import CHOOSING, FRESH, Judgement, judged, judged_all
from ringbalance.results.requirements import MET, MISSED, Proportion
from ringbalance.scene.changes import rechecked
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import value_at

Search = Callable[[Balancer], Settings]
"""The best settings of a balancer."""
Told = Callable[[str], None]
_FIRST: Final = 16
"""Devices after which a remedy with too few that meet is left."""
_TOO_FEW: Final = 0.5
"""Fraction of the devices, as a share of the one asked for, below which it is."""
_MOST: Final = 256
"""Devices that judge a remedy at the most."""
_DIGITS: Final = 2
"""Of a value between two alternatives."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Remedied:
    """Remedies that were made together, and what they come to."""

    remedies: tuple[Remedy, ...]
    judgement: Judgement
    """Of the best settings of the changed scene."""
    size: float
    """Sum of |ln| of every number's change."""
    along: str = ""
    """Path of the axis along which settings may move, such as the supply's pressure: what they set is changed
    by the remedy, too."""

    @property
    def code(self) -> str:
        """Such as "bore" or "bore+limit"."""
        return "+".join(each.code for each in self.remedies)

    @property
    def changes(self) -> Settings:
        """Of the scene, by path, SI, without the settings of its controller."""
        moved = {path: value for path, value in self.judgement.settings.items() if path == self.along}
        return {**_merged(self.remedies), **moved}

    @property
    def settings(self) -> Settings:
        """The best ones under these changes."""
        changed = self.changes
        return {path: value for path, value in self.judgement.settings.items() if path not in changed}

    @property
    def met(self) -> bool:
        """Whether as many devices as asked for meet every demand."""
        return self.judgement.verdict == MET

    @cached_property
    def order(self) -> tuple[object, ...]:
        """First what meets, by fewest and smallest changes, then by fraction."""
        fraction = self.judgement.fraction.value
        return (not self.met, *((len(self.remedies), self.size) if self.met else ()), -fraction)

    def document(self) -> dict[str, Any]:
        """For JSON, SI."""
        half, most = (self.judgement.settling_time(share) for share in (0.5, 0.9))
        return {
            "code": self.code,
            "name": self.remedies[0].name,
            "changes": dict(self.changes),
            "settings": {
                path: list(value) if isinstance(value, tuple) else value
                for path, value in self.settings.items()
            },
            "fraction": self.judgement.fraction.document(),
            "verdict": self.judgement.verdict,
            "half_settle_s": half[0] if half else None,
            "ninety_percent_settle_s": most[0] if most else None,
        }


def tried_remedies(
    balancer: Balancer, own: Judgement, *, search: Search, along: str = "", told: Told | None = None
) -> tuple[Remedied, ...]:
    """What the remedies of a balancer come to, the best first.

    Of one kind, alternatives are tried from the smallest change on until one meets, none meets at all, or
    fewer devices meet than before; where no device of the scene as it is does, until one kind meets.  Where
    none meets by itself, the best two together follow.  The best, and all that meet, are then judged on
    devices on which nothing was chosen.
    Args: `own`: judgement of the best settings of the scene as it is. `search`: best settings. `along`: as
        `Remedied`.
    """
    kinds: dict[str, list[Remedy]] = {}
    for each in balancer.remedies():
        kinds.setdefault(each.code, []).append(each)
    trial = _Trial(balancer=balancer, search=search, along=along, told=told or (lambda _: None))
    rows: list[Remedied] = []
    for some in kinds.values():
        rows += trial.series(some, own.fraction)
        if own.fraction.count == 0 and any(row.met for row in rows):
            break
    if not any(row.met for row in rows):
        rows += trial.pair(rows)
    rows.sort(key=lambda row: row.order)
    return tuple(trial.afresh(row) if row.met or row is rows[0] else row for row in rows)


def tried_choices(
    balancer: Balancer,
    *,
    search: Search,
    along: str = "",
    told: Told | None = None,
    some: slice = slice(None),
) -> tuple[Remedied, ...]:
    """Judge a scene that leaves open what can be bought with each of these things. Args: `some`: which."""
    trial = _Trial(balancer=balancer, search=search, along=along, told=told or (lambda _: None), start=FRESH)
    return tuple(row for each in balancer.choices()[some] if (row := trial.of([each])) is not None)


def amplitude_reached(judgement: Judgement) -> float | None:
    """Amplitude that the fraction of devices asked for surely comes below, m; None: too few devices."""
    last = sorted(judgement.outcomes.final_amplitude.tolist())
    n = len(last)
    surely = (k for k in range(1, n + 1) if Proportion(count=k, of=n).low >= judgement.asked)
    return next((last[k - 1] for k in surely if math.isfinite(last[k - 1])), None)


@dataclass(frozen=True, kw_only=True)
class _Trial:
    """What trials share."""

    balancer: Balancer
    search: Search
    along: str
    told: Told
    start: int = CHOOSING
    """Number of the first device."""

    def of(self, remedies: Sequence[Remedy]) -> Remedied | None:
        """Remedies made together; None: the scene refuses them."""
        changes = _merged(remedies)
        try:
            changed = self._changed(changes)
            self.told(f"trying {', '.join(each.name or each.code for each in remedies)}")
            settings = self.search(changed)
            judgement = _judged(changed, settings, self.start)
        except SceneError:
            return None
        size = _size(self.balancer, changes)
        return Remedied(remedies=tuple(remedies), judgement=judgement, size=size, along=self.along)

    def afresh(self, row: Remedied) -> Remedied:
        """On devices on which nothing was chosen."""
        return replace(
            row, judgement=_judged(self._changed(_merged(row.remedies)), row.judgement.settings, FRESH)
        )

    def _changed(self, changes: Settings) -> Balancer:
        scene = rechecked(self.balancer.scene).with_values(changes, origin="inferred")
        return self.balancer.on_scene(scene)

    def series(self, alternatives: Sequence[Remedy], own: Proportion) -> Iterator[Remedied]:
        """Alternatives of one kind, from the smallest change on."""
        before: Remedied | None = None
        for each in alternatives:
            row = self.of([each])
            if row is None:
                continue
            yield row
            if row.met:
                if before is not None and each.continuous:
                    yield from self._between(before, row)
                return
            fraction = row.judgement.fraction
            if fraction.count == 0 or fraction.high < (before.judgement.fraction if before else own).low:
                return
            before = row

    def _between(self, missed: Remedied, met: Remedied) -> Iterator[Remedied]:
        """The change half-way, by ratios, from one that misses to one that meets."""
        one, other = missed.remedies[0], met.remedies[0]
        changes = {
            path: _rounded(math.sqrt(float(one.changes[path]) * float(value)))
            for path, value in other.changes.items()
        }
        row = self.of([Remedy(code=other.code, changes=changes, continuous=True)])
        if row is not None:
            yield row

    def pair(self, rows: Sequence[Remedied]) -> Iterator[Remedied]:
        """The best two of different kinds together."""
        best = sorted(rows, key=lambda row: row.order)
        for one, other in combinations(best, 2):
            if one.code != other.code and not set(_merged(one.remedies)) & set(_merged(other.remedies)):
                row = self.of([*one.remedies, *other.remedies])
                if row is not None:
                    yield row
                return


def _judged(changed: Balancer, settings: Settings, start: int) -> Judgement:
    """On few devices where far too few of these meet what is asked."""
    (first,) = judged_all(changed, [settings], first=_FIRST, most=_FIRST, start=start)
    if first.verdict == MISSED and first.fraction.value < _TOO_FEW * first.asked:
        return first
    return judged(changed, settings, most=min(_MOST, changed.verdict_draws[1]), start=start)


def _merged(remedies: Sequence[Remedy]) -> dict[str, Any]:
    return {path: value for each in remedies for path, value in each.changes.items()}


def _size(balancer: Balancer, changes: Mapping[str, Any]) -> float:
    """Sum of |ln| of every number's change; 1 for what the scene does not have."""
    sizes = []
    for path, value in changes.items():
        try:
            sizes.append(abs(math.log(float(value) / value_at(balancer.scene, path))))
        except (TypeError, ValueError, ZeroDivisionError):
            sizes.append(1.0)
    return round(math.fsum(sizes), 9)


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
