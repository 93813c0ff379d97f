"""What judgements over drawn devices come to, as plain numbers for the evidence."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import FURTHER, Balancer, Draws, Outcomes, Settings
from ringbalance.controller.judging.judge import MOST_DRAWS, Judgement, judged_all
from ringbalance.controller.judging.ranking import ranked
from ringbalance.controller.judging.remedies import tried_choices, tried_remedies
from ringbalance.controller.judging.search import searched
from ringbalance.controller.judging.tuning import (
    LONGER,
    Tuning,
    judgement_document,
    plain_settings,
    required_document,
)
from ringbalance.reports.prose import key_words, opening
from ringbalance.reports.section import Record
from ringbalance.results.requirements import MET, Proportion
from ringbalance.results.rows import Finding
from ringbalance.scene.describe import setting_text, usual_unit
from ringbalance.scene.draws import BLOCK
from ringbalance.scene.origins import SceneFile, raw_value_at, value_at
from ringbalance.scene.toml import toml_text
from ringbalance.scene.units import shortest, shortest_quantity

_COARSE: Final = 16
"""Devices on which settings for what can be bought are chosen."""
_POINTS: Final = 50
"""Most entries of a curve."""


def own_record(balancer: Balancer, *, first: int, most: int = MOST_DRAWS) -> Record:
    """The scene's own settings over drawn devices, and what mends it where some do not meet what is asked."""
    (own,) = judged_all(balancer, [{}], first=first, most=most)
    suffices = own.verdict == MET or bool(own.meets.all())
    measures = () if suffices else tuple(ranked(balancer, own).findings())
    remedies = () if suffices else tried_remedies(balancer, own, search=searched)
    return {
        "own": judgement_record(own),
        "remedies": [each.document() for each in remedies],
        "measures": [each.document() for each in measures],
    }


def tuning_record(balancer: Balancer, tuning: Tuning) -> Record:
    """The scene's own settings beside the recommended ones, both watched longer too, and what else to do."""
    best, own, document = tuning.recommended, tuning.own, tuning.to_dict()
    recommended = judgement_record(best) | {"longer": tuning.longer and _watched(tuning.longer, LONGER)}
    measures: Iterable[Finding] = tuning.ranking.findings()
    if best.verdict == MET:
        measures = () if own is not None and own.verdict == MET else (Finding(code="settings_suffice"),)
    return {
        "own": None if own is None else judgement_record(own) | {"longer": _longer(balancer)},
        "recommended": recommended if own is None or best.settings else None,
        "moved": _moved(tuning),
        "capacity": [each.document() for each in tuning.capacity],
        **{name: document[name] for name in ("along", "ranking", "remedies")},
        "measures": [each.document() for each in measures],
    }


def _moved(tuning: Tuning) -> Record | None:
    """Where the recommended settings leave the scene's level of the axis, and what serves how many there."""
    path = tuning.along_name
    if path not in tuning.recommended.settings:
        return None
    before = value_at(tuning.given, path)
    at = [each.judgement.fraction.document() for each in tuning.along if each.level == before]
    return {
        "name": key_words(path),
        "unit": tuning.along_unit,
        "before": before,
        "after": tuning.recommended.settings[path],
        "fraction": at[0] if at else None,
    }


def _longer(balancer: Balancer) -> Record:
    (longer,) = judged_all(balancer, [{}], first=BLOCK, most=BLOCK, further=LONGER)
    return _watched(longer, LONGER)


def choice_records(balancer: Balancer, some: slice) -> list[Record]:
    """Some of what can be bought for a scene that leaves it open, and what each makes of it."""
    return [each.document() for each in tried_choices(balancer, search=_coarsely, some=some)]


def _coarsely(balancer: Balancer) -> Settings:
    """The best of the settings that a search begins with: enough to tell what can be bought apart."""
    trials, *_ = balancer.trials()
    names = [axis.name for axis in trials.axes]
    levels = [[axis.levels[at] for at in axis.first] for axis in trials.axes]
    points = [dict(zip(names, point, strict=True)) for point in product(*levels)]
    settings = [found for each in points if (found := trials.settings(each)) is not None]
    ran = zip(settings, balancer.run_all(settings, Draws.first(_COARSE)), strict=True)
    return max(ran, key=lambda each: np.count_nonzero(each[1].settled), default=({}, None))[0]


def judgement_record(judgement: Judgement) -> Record:
    """One setting over drawn devices; SI."""
    pairs = zip(required_document(judgement), judgement.demands, strict=True)
    return {
        **judgement_document(judgement),
        "settings": plain_settings(judgement.settings),
        "asked": judgement.asked,
        "required": [
            {**each, "verdict": judgement.fraction_of(demand).verdict(judgement.asked)}
            for each, demand in pairs
        ],
        "further_s": FURTHER,
        "settled": settled_record(judgement.outcomes),
    }


def _watched(judgement: Judgement, further: float) -> Record:
    return {"further_s": further, "fraction": judgement.fraction.document(), "verdict": judgement.verdict}


def settled_record(outcomes: Outcomes) -> Record:
    """Fraction of the devices that has settled by a time, with its bounds."""
    times = np.sort(outcomes.settling_time[outcomes.settled])
    counts = np.unique(np.linspace(1, times.size, _POINTS).round()) if times.size else np.zeros(0)
    by = [Proportion(count=int(count), of=outcomes.settled.size) for count in counts]
    return {
        "time_s": [float(times[each.count - 1]) for each in by],
        "value": [each.value for each in by],
        "low": [each.low for each in by],
        "high": [each.high for each in by],
    }


def advice_view(found: Record) -> Record:
    """Remedies and measurements in words."""
    return {
        "remedies": [_remedy(each) for each in found.get("remedies", ())],
        "measures": [each["text"] for each in found.get("measures", ())],
    }


def _remedy(row: Record) -> str:
    """The change of the scene in words."""
    changes = [f"{key_words(path)} {setting_text(path, value)}" for path, value in row["changes"].items()]
    # What a sensor does, a filter may be told in a key of the same name.
    return opening(", ".join(dict.fromkeys(changes)))


def settings_lines(scene: SceneFile, paths: Iterable[str]) -> list[Record]:
    """Values of a scene as lines of its file, by table; what it leaves out is left out."""
    tables: dict[str, list[str]] = {}
    for path in paths:
        table, _, key = path.partition(".")
        value = raw_value_at(scene, path)
        if value not in (None, ()):
            tables.setdefault(table, []).append(f"{key} = {toml_text(_written(value, path))}")
    return [{"table": table, "lines": lines} for table, lines in tables.items()]


def _written(value: Any, path: str) -> Any:
    if isinstance(value, tuple):
        # One time for all chambers is written as it is read, and not as a list of one.
        return _written(value[0], path) if len(value) == 1 else [_written(each, path) for each in value]
    if isinstance(value, str | bool | int):
        return value
    unit = usual_unit(path)
    return shortest_quantity(value, unit) if unit not in ("", "1") else float(shortest(value))
