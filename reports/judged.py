"""Evidence of the report from judgements on drawn devices, as plain JSON records in SI."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import WATCH_TIME_S, Balancer, Outcomes
from ringbalance.controller.judging.judge import Judgement, judged_all, plain_settings
from ringbalance.controller.judging.tuning import LONG_WATCH_TIME_S, Tuning, runout_findings
from ringbalance.reports.prose import key_words, opening
from ringbalance.reports.section import Record
from ringbalance.results.requirements import MET, Proportion
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import finite
from ringbalance.scene.describe import setting_text, usual_unit
from ringbalance.scene.draws import BLOCK
from ringbalance.scene.origins import SceneFile, raw_value_at, value_at
from ringbalance.scene.toml import toml_text
from ringbalance.scene.units import shortest, shortest_quantity

_MAX_CURVE_POINTS: Final = 50
_MAX_DOMINANT: Final = 3
_LIMIT: Final = "controller.limit"
_LIMIT_DIGITS: Final = 3
_ROUNDING: Final = 1e-9
"""Relative rounding error of a number that has no more digits than are kept."""


def tuning_record(balancer: Balancer, tuning: Tuning) -> Record:
    """Judge the scene's own and the recommended settings, both also watched for `LONG_WATCH_TIME_S`."""

    def watched(judgement: Judgement) -> Record:
        fraction = judgement.fraction.document()
        return {"further_s": LONG_WATCH_TIME_S, "fraction": fraction, "verdict": judgement.verdict}

    best, scene_judgement, document = tuning.recommended, tuning.own, tuning.to_dict()
    own_document, recommended, moved = None, None, None
    if scene_judgement is not None:
        (own_longer,) = judged_all(balancer, [{}], first=BLOCK, most=BLOCK, watch_time=LONG_WATCH_TIME_S)
        own_document = judgement_record(scene_judgement) | {"longer": watched(own_longer)}
    if scene_judgement is None or best.settings:
        recommended = judgement_record(best) | {"longer": tuning.longer and watched(tuning.longer)}
    if (path := tuning.along_name) in best.settings:
        # The recommended settings change the scene's value on the scan axis.
        before = value_at(tuning.given, path)
        at_scene_level = [each.judgement.fraction.document() for each in tuning.along if each.level == before]
        moved = {
            "name": key_words(path),
            "unit": tuning.along_unit,
            "before": before,
            "after": best.settings[path],
            "fraction": at_scene_level[0] if at_scene_level else None,
        }
    measures: Iterable[Finding] = tuning.ranking.findings()
    if best.verdict == MET:
        measures = (
            ()
            if scene_judgement is not None and scene_judgement.verdict == MET
            else (Finding(code="settings_suffice"),)
        )
    runout = [each.document() for each in runout_findings(best)]
    return {
        "own": own_document,
        "recommended": recommended,
        "moved": moved,
        "capacity": [each.document() for each in tuning.capacity],
        **({"endurance": tuning.endurance.document()} if tuning.endurance else {}),
        **({"runout": runout} if runout else {}),
        "standards": [each.document() for each in tuning.standards],
        **{name: document[name] for name in ("along", "ranking", "remedies")},
        "measures": [each.document() for each in measures],
    }


def judgement_record(judgement: Judgement) -> Record:
    """A judgement with the verdict on every requirement and the curve of settled devices."""
    required = judgement.demands_document()
    for document, demand in zip(required, judgement.demands, strict=True):
        document["verdict"] = judgement.fraction_of(demand).verdict(judgement.required_fraction)
    return {
        **judgement.document(),
        "settings": plain_settings(judgement.settings),
        "asked": judgement.required_fraction,
        "required": required,
        "further_s": WATCH_TIME_S,
        "energy_J": {
            f"p{percent}": finite(float(np.quantile(judgement.outcomes.energy, percent / 100)))
            for percent in (50, 90)
        },
        "settled": settled_record(judgement.outcomes),
    }


def settled_record(outcomes: Outcomes) -> Record:
    """Fraction of the devices that has settled by a time, with its 95 % bounds, as a curve."""
    times = np.sort(outcomes.settling_time[outcomes.settled])
    counts = np.unique(np.linspace(1, times.size, _MAX_CURVE_POINTS).round()) if times.size else np.zeros(0)
    fractions = [Proportion(count=int(count), of=outcomes.settled.size) for count in counts]
    return {
        "time_s": [float(times[each.count - 1]) for each in fractions],
        "value": [each.value for each in fractions],
        "low": [each.low for each in fractions],
        "high": [each.high for each in fractions],
    }


def advice_view(record: Record) -> Record:
    """Remedies and measurements as text; indices of the inputs that decide most between devices."""
    remedies = []
    for remedy in record.get("remedies", ()):
        changes = [
            f"{key_words(path)} {setting_text(path, value)}" for path, value in remedy["changes"].items()
        ]
        # A filter may have its own key for a property of the sensor: its words are those of the sensor's key.
        remedies.append(opening(", ".join(dict.fromkeys(changes))))
    ranking = record.get("ranking", ())[:_MAX_DOMINANT]
    return {
        "remedies": remedies,
        "measures": [each["text"] for each in record.get("measures", ())],
        "dominant": [i for i, each in enumerate(ranking) if each["index"] > each["noise"]],
    }


def settings_lines(scene: SceneFile, paths: Iterable[str]) -> list[Record]:
    """Values of a scene as lines of its file, by table, without those that it leaves out.

    A limit, which may follow from a balance quality grade, is rounded down to three digits.
    """

    def written(value: Any, path: str) -> Any:
        if isinstance(value, tuple):
            # One value for all chambers is written without a list.
            return written(value[0], path) if len(value) == 1 else [written(each, path) for each in value]
        if isinstance(value, str | bool | int):
            return value
        if path == _LIMIT and value > 0:
            digit = 10.0 ** (math.floor(math.log10(value)) - _LIMIT_DIGITS + 1)
            value = digit * math.floor(value / digit * (1 + _ROUNDING))
        unit = usual_unit(path)
        return shortest_quantity(value, unit) if unit not in ("", "1") else float(shortest(value))

    tables: dict[str, list[str]] = {}
    for path in paths:
        table, _, key = path.partition(".")
        value = raw_value_at(scene, path)
        if value not in (None, ()):
            tables.setdefault(table, []).append(f"{key} = {toml_text(written(value, path))}")
    return [{"table": table, "lines": lines} for table, lines in tables.items()]
