"""`tune`: choose settings by runs of few drawn devices, and judge them on others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from ringbalance.controller.balancer import Balancer, Settings
from ringbalance.controller.judging.candidates import Tried, supersedes
from ringbalance.controller.judging.holding import endurance
from ringbalance.controller.judging.judge import Judgement, best_of, judged_all
from ringbalance.controller.judging.ranking import ranked
from ringbalance.controller.judging.remedies import tried_choices, tried_remedies, with_changes
from ringbalance.controller.judging.search import (
    Progress,
    ScanLevel,
    scanned,
    search,
    searched,
)
from ringbalance.controller.judging.tuning import LONG_WATCH_TIME_S, Tuning
from ringbalance.controller.rotor import CommonRotor
from ringbalance.results.requirements import MET
from ringbalance.results.rows import Finding
from ringbalance.scene.draws import BLOCK
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import value_at, with_values_at

_MAX_LONGER_DEVICES: Final = 4 * BLOCK
"""Devices watched for `LONG_WATCH_TIME_S` where one block is undecided."""


def tuned(
    balancer: Balancer,
    *,
    scan: bool = False,
    curve: bool = False,
    remedies: bool = False,
    choices: bool = False,
    progress: Progress | None = None,
) -> Tuning:
    """Choose and judge settings for a balancer.

    Args: `scan`: scan the axis `Trials.scan_axis`, such as the supply's pressure, in any case; otherwise only
            where the scene's own level does not meet what is required.
        `curve`: judge the levels of that axis in any case; where the scene's own level meets what is required
            they decide nothing.
        `remedies`: try remedies where the requirement is not met. `choices`: judge parts that can be bought
            where the scene leaves the choice open.
    """
    report = progress or (lambda _: None)
    spaces = balancer.trials()
    winners: Sequence[Tried] = search(balancer, spaces, progress=report) if spaces else ()

    # The scene's own settings and the best, on the same devices, on which nothing was chosen.
    states_own = not spaces or spaces[0].stated
    stated: list[Settings] = [{}] if states_own or not winners else []
    proposed = [each for each in _worth_judging(winners) if each not in stated]
    chosen = best_of(balancer, [*proposed, *stated], progress=report)
    fresh = stated if chosen in stated else [*stated, chosen]
    judgements = judged_all(balancer, fresh, progress=report)
    unchanged, best = judgements[0] if states_own else None, judgements[-1]
    if unchanged is not None and not supersedes(best, unchanged):
        best = unchanged

    levels: tuple[ScanLevel, ...] = ()
    move = scan or best.verdict != MET
    if winners and (curve or move):
        levels, winners_there = scanned(balancer, spaces, winners, progress=report)
        proposed = _worth_judging(winners_there) if move else []
        chosen = best_of(balancer, [best.settings, *proposed], progress=report)
        if chosen != best.settings:
            (moved,) = judged_all(balancer, [chosen], progress=report)
            if supersedes(moved, best):
                best, winners = moved, winners_there

    # Where no device meets the demands, a longer watch time changes nothing.
    longer: Judgement | None = None
    if not balancer.watched_to_end and best.fraction.count:
        most = max(BLOCK, min(_MAX_LONGER_DEVICES, balancer.verdict_draws[1]))
        (longer,) = judged_all(
            balancer, [best.settings], first=BLOCK, most=most, watch_time=LONG_WATCH_TIME_S, progress=report
        )

    # Findings on the capacity where it decides a verdict, for the scene's settings first.
    capacity: tuple[Finding, ...] = ()
    for name, each in (("the scene's settings", unchanged), ("the recommended settings", best)):
        if each is not None and each.verdict != MET and not capacity:
            scene = with_values_at(balancer.scene, each.settings)
            capacity = balancer.beyond_capacity(scene, each.outcomes.ended, name)

    axis = spaces[0].scan_axis if spaces else None
    axis_name = axis.name if axis else ""
    level = best.settings.get(axis.name) if axis else None
    final_level = value_at(balancer.scene, axis.name) if axis and level is None else level
    mend = remedies and best.verdict != MET
    find = partial(searched, level=level)
    tuning = Tuning(
        given=balancer.scene,
        recommended=best,
        own=unchanged,
        longer=longer,
        tried={each.candidate.trials.kind: each.judgement for each in winners},
        # The recommended level carries the recommended verdict.
        along=tuple(replace(each, judgement=best) if each.level == final_level else each for each in levels),
        along_name=axis_name,
        along_unit=axis.unit if axis else "1",
        rotor=_rotor(balancer),
        capacity=capacity,
        ranking=ranked(balancer, best),
        remedies=(
            tried_remedies(balancer, best, search=find, scan_path=axis_name, progress=report) if mend else ()
        ),
        choices=(
            tried_choices(balancer, settings=best.settings, scan_path=axis_name, progress=report)
            if choices
            else ()
        ),
        open_choice=bool(balancer.choices()),
    )
    # With the settings that are recommended, those of a part that can be bought where one suffices.
    part = tuning.best_choice
    mounted = with_changes(balancer, part.changes) if part and part.met else balancer
    return replace(
        tuning,
        information=balancer.information(tuning.scene),
        endurance=endurance(mounted, tuning.judgement if part and part.met else best, report),
    )


def _rotor(balancer: Balancer) -> CommonRotor | None:
    """Rotor of a balancer; None: it stands still, or never vibrates steadily."""
    try:
        return balancer.rotor()
    except SceneError:
        return None


def _worth_judging(winners: Sequence[Tried]) -> list[Settings]:
    """Settings of the recommended kind of controller, and of other kinds that serve more devices."""
    first = [winner for i, winner in enumerate(winners) if i == 0 or winner.fraction > winners[0].fraction]
    return [winner.candidate.settings or {} for winner in first]
