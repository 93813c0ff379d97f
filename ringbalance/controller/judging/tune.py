"""How `tune` comes to its settings: chosen by runs of few drawn devices, judged on others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from ringbalance.controller.balancer import Balancer, Settings
from ringbalance.controller.judging.candidates import Tried
from ringbalance.controller.judging.judge import Judgement, best_of, judged, judged_all
from ringbalance.controller.judging.ranking import ranked
from ringbalance.controller.judging.remedies import tried_choices, tried_remedies
from ringbalance.controller.judging.search import (
    Along,
    Curve,
    Progress,
    search,
    searched,
    searched_along,
)
from ringbalance.controller.judging.tuning import LONGER, BestOfKind, Tuning
from ringbalance.results.requirements import MET
from ringbalance.results.rows import Finding
from ringbalance.scene.draws import BLOCK
from ringbalance.scene.origins import value_at, with_values_at

_MOST_LONGER: Final = 4 * BLOCK
"""Devices that are watched longer where 64 do not decide."""


def tuned(
    balancer: Balancer,
    *,
    along: bool = False,
    remedies: bool | None = False,
    progress: Progress | None = None,
) -> Tuning:
    """Settings of a balancer by runs.

    Args: `along`: whether what `Trials.along` names, such as the supply's pressure, is searched in any case;
        else only where the scene's level of it does not suffice.
        `remedies`: whether those are tried where what is required is not met, and choices that the scene
        leaves open; None: the former alone.
    """
    told = progress or (lambda _: None)
    trials = balancer.trials()
    found: Sequence[Tried] = search(balancer, trials, progress=told) if trials else ()
    stated = not trials or trials[0].stated
    own, best = _judged(balancer, found, own=stated, progress=told)
    curve: Curve | None = None
    if found and (along or best.verdict != MET):
        curve = searched_along(balancer, trials, found, progress=told)
        best, found = _better(balancer, best, found, curve, progress=told)
    # Of devices of which none settles, none stays so for longer.
    watched = balancer.watched_to_end or not best.fraction.count
    longer = None if watched else _longer(balancer, best.settings, progress=told)
    axis = trials[0].along if trials else None
    level = None if axis is None else best.settings.get(axis.name)
    own_level = None if axis is None else value_at(balancer.scene, axis.name)
    name = axis.name if axis else ""
    settings = partial(searched, along=level)
    mends = remedies is not False and best.verdict != MET
    return Tuning(
        given=balancer.scene,
        recommended=best,
        own=own,
        longer=longer,
        tried=tuple(BestOfKind(kind=each.candidate.trials.kind, judgement=each.judgement) for each in found),
        along=tuple(
            _agreeing(each, best, own_level if level is None else level)
            for each in (curve.levels if curve else ())
        ),
        along_name=name,
        along_unit=axis.unit if axis else "1",
        information=balancer.information(with_values_at(balancer.scene, best.settings)),
        capacity=_capacity(balancer, own, best),
        ranking=ranked(balancer, best),
        remedies=tried_remedies(balancer, best, search=settings, along=name, told=told) if mends else (),
        choices=tried_choices(balancer, search=settings, along=name, told=told) if remedies else (),
        open_choice=bool(balancer.choices()),
    )


def _capacity(balancer: Balancer, own: Judgement | None, best: Judgement) -> tuple[Finding, ...]:
    """What is said of capacity where it decides a verdict, of the scene's settings first."""
    for name, each in (("the scene's settings", own), ("the recommended settings", best)):
        if each is not None and each.verdict != MET:
            scene = with_values_at(balancer.scene, each.settings)
            if found := balancer.beyond_capacity(scene, each.outcomes.ended, name):
                return found
    return ()


def _agreeing(level: Along, best: Judgement, recommended: float | None) -> Along:
    """A level of the curve; at that of the recommended settings with their own verdict."""
    return replace(level, judgement=best) if level.level == recommended else level


def _judged(
    balancer: Balancer, found: Sequence[Tried], *, own: bool, progress: Progress
) -> tuple[Judgement | None, Judgement]:
    """Of the scene's own settings and of the best, on the same devices, on which nothing was chosen."""
    stated: list[Settings] = [{}] if own or not found else []
    best = best_of(
        balancer, [*(each for each in _to_judge(found) if each not in stated), *stated], progress=progress
    )
    judged = judged_all(balancer, stated + [each for each in [best] if each not in stated], progress=progress)
    return judged[0] if own else None, judged[-1]


def _longer(balancer: Balancer, settings: Settings, *, progress: Progress) -> Judgement:
    most = max(BLOCK, min(_MOST_LONGER, balancer.verdict_draws[1]))
    return judged_all(balancer, [settings], first=BLOCK, most=most, further=LONGER, progress=progress)[0]


def _to_judge(found: Sequence[Tried]) -> list[Settings]:
    """Of the kind that is first, and of others that serve more devices."""
    most = found[0].fraction if found else 0.0
    kept = [each for place, each in enumerate(found) if place == 0 or each.fraction > most]
    return [each.candidate.settings or {} for each in kept]


def _better(
    balancer: Balancer, best: Judgement, found: Sequence[Tried], curve: Curve | None, *, progress: Progress
) -> tuple[Judgement, Sequence[Tried]]:
    """The best settings at the best level, where these serve more devices."""
    there = [] if curve is None else _to_judge(curve.searched)
    chosen = best_of(balancer, [best.settings, *there], progress=progress)
    if curve is None or chosen == best.settings:
        return best, found
    return judged(balancer, chosen, progress=progress), curve.searched
