"""Remedies: changes of the scene, each judged with the best settings of the changed scene.

Inputs are drawn by name and number, so a device is the same under every remedy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import Balancer, Draws, Remedy, Settings
from ringbalance.controller.judging.judge import (
    FIRST_CHOOSING_DEVICE,
    FIRST_VERDICT_DEVICE,
    Judgement,
    judged_all,
    plain_settings,
)
from ringbalance.controller.trials import Indices
from ringbalance.results.requirements import MET, MISSED
from ringbalance.results.rows import series
from ringbalance.scene.changes import rechecked
from ringbalance.scene.describe import setting_text
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import value_at

Search = Callable[[Balancer], Settings]
Progress = Callable[[str], None]
_FIRST_DEVICES: Final = 16
"""Devices after which a remedy that serves far too few is given up."""
_GIVE_UP_SHARE: Final = 0.5
"""Ratio to the required fraction below which a remedy is given up."""
_MAX_DEVICES: Final = 256
_COARSE_DEVICES: Final = (4, 4, 8)
"""Further devices in each round of a coarse grid; the best third of the settings and its ties go on."""
_NEAR_DEVICES: Final = (8, 40)
"""Further devices in each round of the levels beside its best."""
_HALFWAY_DIGITS: Final = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Remedied:
    """Remedies applied together, with the judgement of the best settings of the changed scene."""

    remedies: tuple[Remedy, ...]
    judgement: Judgement
    size: float
    """Sum of |ln(new/old)| over all changed numbers; 1 for a value that the scene does not have."""
    scan_path: str = ""
    """Path of the scan axis of the settings, such as the supply's pressure; its value counts as a change of
    the remedy."""

    @property
    def code(self) -> str:
        """Codes of the remedies, such as "bore" or "bore+limit"."""
        return "+".join(remedy.code for remedy in self.remedies)

    @property
    def changes(self) -> Settings:
        """Changes of the scene by path, SI, without the settings of its controller."""
        moved = {path: value for path, value in self.judgement.settings.items() if path == self.scan_path}
        return {**_merged(self.remedies), **moved}

    @property
    def settings(self) -> Settings:
        """The best settings under these changes."""
        changes = self.changes
        return {path: value for path, value in self.judgement.settings.items() if path not in changes}

    @property
    def assumed(self) -> str:
        """Changes whose values the program assumes, in words: "valve lag of 20 ms"; else empty."""
        paths = [path for remedy in self.remedies for path in remedy.assumed]
        words = (f"{path.split('.')[1]} of {setting_text(path, self.changes[path])}" for path in paths)
        return series([each.replace("_", " ") for each in words])

    @property
    def met(self) -> bool:
        """True if the verdict is `MET`."""
        return self.judgement.verdict == MET

    @cached_property
    def order(self) -> tuple[object, ...]:
        """Sort key: remedies that meet the requirement come first, by number and size of changes."""
        fraction = self.judgement.fraction.value
        return (not self.met, *((len(self.remedies), self.size) if self.met else ()), -fraction)

    def document(self) -> dict[str, Any]:
        """The remedies with their judgement for JSON, SI."""
        times = self.judgement.settling_times
        return {
            "code": self.code,
            "name": self.remedies[0].name,
            "changes": dict(self.changes),
            "assumed": self.assumed,
            "settings": plain_settings(self.settings),
            "fraction": self.judgement.fraction.document(),
            "verdict": self.judgement.verdict,
            "half_settle_s": times["p50"],
            "ninety_percent_settle_s": times["p90"],
        }


def tried_remedies(
    balancer: Balancer,
    unchanged: Judgement,
    *,
    search: Search,
    scan_path: str = "",
    progress: Progress | None = None,
) -> tuple[Remedied, ...]:
    """Judge the remedies that a balancer offers, and sort them, the best first.

    The alternatives of one kind are tried in order of increasing change, until one meets the requirement, no
    device meets it, or significantly fewer do than before; where no device of the unchanged scene does, the
    first kind that meets it is the last tried.  Where no remedy is enough by itself, the best two are tried
    together.  The best, and all that meet, are then judged on devices on which nothing was chosen.

    Args: `unchanged`: judgement of the best settings of the unchanged scene. `search`: finds settings.
        `scan_path`: as in `Remedied`.
    """
    kinds: dict[str, list[Remedy]] = {}
    for remedy in balancer.remedies():
        kinds.setdefault(remedy.code, []).append(remedy)
    judge = partial(_judge, balancer, search=search, scan_path=scan_path, progress=progress)
    rows: list[Remedied] = []
    for alternatives in kinds.values():
        missed: Remedied | None = None
        for remedy in alternatives:
            row = judge([remedy])
            if row is None:
                continue
            rows.append(row)
            if row.met and missed is not None and remedy.continuous:
                # The geometric mean of a change that misses and one that meets may be enough.
                smaller = missed.remedies[0].changes
                changes = {
                    path: float(f"{math.sqrt(float(smaller[path]) * float(value)):.{_HALFWAY_DIGITS}g}")
                    for path, value in remedy.changes.items()
                }
                halfway = Remedy(code=remedy.code, changes=changes, continuous=True)
                rows += filter(None, [judge([halfway])])
            fraction, before = row.judgement.fraction, (missed.judgement if missed else unchanged).fraction
            if row.met or fraction.count == 0 or fraction.high < before.low:
                break
            missed = row
        if unchanged.fraction.count == 0 and any(row.met for row in rows):
            break
    if not any(row.met for row in rows):
        for first, second in combinations(sorted(rows, key=lambda row: row.order), 2):
            shared = _merged(first.remedies).keys() & _merged(second.remedies).keys()
            if first.code != second.code and not shared:
                rows += filter(None, [judge([*first.remedies, *second.remedies])])
                break
    rows.sort(key=lambda row: row.order)
    return tuple(
        replace(
            row,
            judgement=_judgement(
                with_changes(balancer, _merged(row.remedies)), row.judgement.settings, FIRST_VERDICT_DEVICE
            ),
        )
        if row.met or row is rows[0]
        else row
        for row in rows
    )


def tried_choices(
    balancer: Balancer,
    *,
    settings: Settings,
    scan_path: str = "",
    progress: Progress | None = None,
    some: slice = slice(None),
) -> tuple[Remedied, ...]:
    """Judge parts that can be bought for what a scene leaves open, each with the best of a coarse grid.

    Args: `settings`: settings around which the grid lies, the best with an ideal part. `scan_path`: as in
        `Remedied`. `some`: slice of the balancer's choices to judge.
    """

    def search(changed: Balancer) -> Settings:
        return {**settings, **coarse_settings(with_changes(changed, settings))}

    judge = partial(_judge, balancer, search=search, scan_path=scan_path, progress=progress)
    rows = (judge([choice], start=FIRST_VERDICT_DEVICE) for choice in balancer.choices()[some])
    return tuple(row for row in rows if row is not None)


def coarse_settings(balancer: Balancer) -> Settings:
    """Best settings for the first kind of controller, by how many devices settle: of a coarse grid, then of
    the levels beside its best on one or two axes, each raced over devices of its own.
    """
    space = balancer.trials()[0]

    def race(points: Sequence[Indices], rounds: Sequence[int], start: int) -> Indices | None:
        left = [point for point in points if space.at(point) is not None]
        counts = np.zeros(len(left), dtype=np.int64)
        for count in rounds if left else ():
            outcomes = balancer.run_all([space.at(point) or {} for point in left], Draws.block(start, count))
            counts += [int(np.count_nonzero(each.settled)) for each in outcomes]
            leading = np.flatnonzero(counts >= -np.sort(-counts)[(len(left) - 1) // 3])
            left, counts, start = [left[i] for i in leading], counts[leading], start + count
        return left[int(np.argmax(counts))] if left else None

    best = race(space.first, _COARSE_DEVICES, 0)
    if best is None:
        return {}
    # In the order of the grid after the best itself, which wins among equals.
    two_steps = {near for each in space.neighbours(best) for near in (each, *space.neighbours(each))}
    near = sorted(each for each in two_steps if all(abs(i - j) <= 1 for i, j in zip(each, best, strict=True)))
    best = race([best, *(each for each in near if each != best)], _NEAR_DEVICES, sum(_COARSE_DEVICES)) or best
    return space.at(best) or {}


def _judge(
    balancer: Balancer,
    remedies: Sequence[Remedy],
    *,
    search: Search,
    scan_path: str,
    progress: Progress | None,
    start: int = FIRST_CHOOSING_DEVICE,
) -> Remedied | None:
    """Judge remedies applied together; None: the changed scene is refused.

    Args: `start`: number of the first device.
    """
    changes = _merged(remedies)
    try:
        changed = with_changes(balancer, changes)
        if progress is not None:
            progress(f"trying {', '.join(remedy.name or remedy.code for remedy in remedies)}")
        judgement = _judgement(changed, search(changed), start)
    except SceneError:
        return None
    sizes = []
    for path, value in changes.items():
        try:
            sizes.append(abs(math.log(float(value) / value_at(balancer.scene, path))))
        except (TypeError, ValueError, ZeroDivisionError):
            sizes.append(1.0)
    size = round(math.fsum(sizes), 9)
    return Remedied(remedies=tuple(remedies), judgement=judgement, size=size, scan_path=scan_path)


def with_changes(balancer: Balancer, changes: Settings) -> Balancer:
    """The balancer on its scene with changes. Raises: SceneError: these are refused."""
    return balancer.on_scene(rechecked(balancer.scene).with_values(changes, origin="inferred"))


def _judgement(changed: Balancer, settings: Settings, start: int) -> Judgement:
    """Judge settings; on few devices only, if far too few of these meet the requirement."""
    (first,) = judged_all(changed, [settings], first=_FIRST_DEVICES, most=_FIRST_DEVICES, start=start)
    if first.verdict == MISSED and first.fraction.value < _GIVE_UP_SHARE * first.required_fraction:
        return first
    most = min(_MAX_DEVICES, changed.verdict_draws[1])
    return judged_all(changed, [settings], most=most, start=start)[0]


def _merged(remedies: Sequence[Remedy]) -> dict[str, Any]:
    """Changes of remedies applied together, by path."""
    return {path: value for remedy in remedies for path, value in remedy.changes.items()}
