"""What judgements over drawn devices come to, as plain numbers for the evidence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import FURTHER, Balancer, Draws, Outcomes, Settings
from ringbalance.controller.judging.judge import MOST_DRAWS, Judgement, judged_all
from ringbalance.controller.judging.ranking import ranked
from ringbalance.controller.judging.remedies import tried_choices, tried_remedies
from ringbalance.controller.judging.search import Along, searched
from ringbalance.controller.judging.tuning import Tuning, setting_text
from ringbalance.reports.prose import key_words
from ringbalance.reports.section import Record
from ringbalance.results.proportion import Proportion
from ringbalance.results.requirements import MET
from ringbalance.results.rows import Finding
from ringbalance.scene.describe import usual_unit
from ringbalance.scene.draws import BLOCK
from ringbalance.scene.origins import SceneFile, value_at
from ringbalance.scene.toml import toml_text
from ringbalance.scene.units import shortest, shortest_quantity

LONGER: Final = 300.0
"""s, for which runs are watched again, to show what longer watching changes."""
HALF, MOST = 0.5, 0.9
"""Fractions of all devices whose settling times are told."""
_COARSE: Final = 16
"""Devices on which settings for what can be bought are chosen."""
_POINTS: Final = 50
"""Most entries of a curve."""
_BAND: Final = (0.025, 0.5, 0.975)
"""Quantiles between which 95 % of the devices lie, and their median."""


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
    best, own = tuning.recommended, tuning.own
    longer = tuning.longer and _watched(tuning.longer, LONGER)
    recommended = judgement_record(best) | {"longer": longer}
    return {
        "own": None if own is None else judgement_record(own) | {"longer": _longer(balancer)},
        "recommended": recommended if own is None or best.settings else None,
        "along": {
            "path": tuning.along_name,
            "levels": [_level(each) for each in tuning.along],
        },
        "moved": _moved(tuning),
        "ranking": tuning.ranking.document(),
        **_advice(tuning),
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


def _advice(tuning: Tuning) -> Record:
    """Remedies and measurements where too few devices meet what is asked, and what can be bought."""
    best, own = tuning.recommended, tuning.own
    if best.verdict == MET:
        enough = own is not None and own.verdict == MET
        measures = () if enough else (Finding(code="settings_suffice"),)
        return {"remedies": [], "measures": [each.document() for each in measures]}
    return {
        "remedies": [each.document() for each in tuning.remedies],
        "measures": [each.document() for each in tuning.ranking.findings()],
    }


def choice_records(balancer: Balancer) -> list[Record]:
    """What can be bought for a scene that leaves it open, and what each makes of it."""
    return [each.document() for each in tried_choices(balancer, search=_coarsely)]


def _coarsely(balancer: Balancer) -> Settings:
    """The best of the settings that a search begins with: enough to tell what can be bought apart."""
    trials, *_ = balancer.trials()
    names = [axis.name for axis in trials.axes]
    levels = [[axis.levels[at] for at in axis.first] for axis in trials.axes]
    points = [dict(zip(names, point, strict=True)) for point in product(*levels)]
    settings = [found for each in points if (found := trials.settings(each)) is not None]
    ran = zip(settings, balancer.run_all(settings, Draws.first(_COARSE)), strict=True)
    return max(ran, key=lambda each: np.count_nonzero(each[1].settled), default=({}, None))[0]


def _level(each: Along) -> Record:
    """Of the axis on which the scene's gas pressure lies."""
    found = each.judgement
    return {
        "value": each.level,
        "fraction": found.fraction.document(),
        "verdict": found.verdict,
        "half_s": _time(found, HALF),
        "most_s": _time(found, MOST),
        "usable_moment_kg_m": np.nanquantile(found.outcomes.usable_moment, _BAND).tolist(),
    }


def judgement_record(judgement: Judgement) -> Record:
    """One setting over drawn devices; SI."""
    outcomes = judgement.outcomes
    return {
        "settings": dict(judgement.settings),
        "asked": judgement.asked,
        "demands": [
            {
                "code": each.code,
                "sense": each.sense,
                "required": each.required,
                "unit": each.unit,
                "stated": each.stated,
                "fraction": judgement.fraction_of(each).document(),
                "verdict": judgement.fraction_of(each).verdict(judgement.asked),
            }
            for each in judgement.demands
        ],
        **_watched(judgement, FURTHER),
        "half_s": _time(judgement, HALF),
        "most": MOST,
        "most_s": _time(judgement, MOST),
        "usable_moment_kg_m": np.nanquantile(outcomes.usable_moment, _BAND).tolist(),
        "settled": _settled(outcomes),
        "ended": dict(Counter(outcomes.ended).most_common()),
        "clipped": dict(outcomes.clipped),
    }


def _watched(judgement: Judgement, further: float) -> Record:
    return {
        "further_s": further,
        "fraction": judgement.fraction.document(),
        "verdict": judgement.verdict,
    }


def _time(judgement: Judgement, fraction: float) -> list[float] | None:
    times = judgement.settling_time(fraction)
    return None if times is None else list(times)


def _settled(outcomes: Outcomes) -> Record:
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
    text = ", ".join(dict.fromkeys(changes))
    return f"{text[0].upper()}{text[1:]}"


def settings_text(rows: Iterable[Record]) -> str:
    """Settings as a block to put into a scene file."""
    tables: dict[str, list[str]] = {}
    for row in rows:
        table, _, key = row["path"].partition(".")
        tables.setdefault(table, []).append(f"{key} = {row['text']}")
    return "\n\n".join("\n".join([f"[{table}]", *lines]) for table, lines in tables.items())


def settings_rows(scene: SceneFile, paths: Iterable[str]) -> Iterator[Record]:
    """Values of a scene as its file would have them, by path; what it leaves out is left out."""
    for path in paths:
        table, _, key = path.partition(".")
        value = getattr(getattr(scene, table), key)
        if value not in (None, ()):
            yield {"path": path, "text": toml_text(_written(value, path))}


def _written(value: Any, path: str) -> Any:
    if isinstance(value, tuple):
        return [_written(each, path) for each in value]
    if isinstance(value, str | bool | int):
        return value
    unit = usual_unit(path)
    return shortest_quantity(value, unit) if unit not in ("", "1") else float(shortest(value))
