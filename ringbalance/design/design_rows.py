"""A `Design` as rows and as a JSON document."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import REQUIRED_FRACTION, Demand, balancer_of
from ringbalance.controller.judging.judge import Judgement, plain_settings
from ringbalance.controller.judging.ranking import Ranking
from ringbalance.controller.judging.tuning import (
    if_exact,
    reported_findings,
    reported_quantities,
    required_table,
    time_findings,
)
from ringbalance.design.axes import Point
from ringbalance.design.designing import Design
from ringbalance.design.races import PRESSURE
from ringbalance.design.space import VALVE
from ringbalance.results.numbers import MISSING, format_given, percent, with_unit
from ringbalance.results.requirements import AT_LEAST, MET, MISSED, OPEN
from ringbalance.results.result import Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import finite
from ringbalance.scene.describe import setting_text
from ringbalance.scene.origins import SceneFile, raw_value_at

CODES: Final = {MET: "design_met", MISSED: "design_missed", OPEN: "design_open"}
_EDGES: Final = {
    True: ("design_edge", "design_edge_default"),
    False: ("design_edge_missed", "design_edge_missed_default"),
}
"""Codes by success of the design: value at an end of a range from the scene, and of a default range."""
_EDGE_FRACTION: Final = 0.02
"""Relative distance below which a value counts as at an end of its range."""


def design_rows(design: Design) -> Rows:
    """Rows of a design: its verdict, alternatives, and the effects of changes."""
    judgement = design.judgement
    tables = () if judgement is None else (_keys_table(design, judgement), required_table(judgement))
    held = (design.endurance.table,) if design.endurance else ()
    return Rows(
        title=f"Design for {design.given.name} ({design.given.source})",
        quantities=tuple(_quantities(design)),
        findings=tuple(_findings(design)),
        tables=(*tables, *_unchanged_table(design), _effects_table(design), _front_table(design), *held),
    )


def design_document(design: Design) -> dict[str, Any]:
    """JSON document of a design, SI."""
    scene, judgement, static = design.given, design.judgement, design.static
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": scene.balancer,
        "designs": {
            "static": static.points,
            "refused": len(static.refusals),
            "blocked": static.blocked,
            "able": static.able,
            "raced": design.raced,
        },
        "needed_unbalance_kg_m": design.needed,
        "largest_reach_kg_m": finite(static.reach),
        "reach_kg_m": design.reach,
        "size_m3": None if judgement is None else design.size,
        "size_uncertainty": design.doubt,
        "smaller": design.smaller
        and {"size_m3": design.smaller[0], "fraction": design.smaller[1].document()},
        "parts": design.space.names(design.point) if judgement else {},
        "changes": plain_settings(design.point) if judgement else {},
        "settings": plain_settings(judgement.settings) if judgement else {},
        "asked": judgement.required_fraction if judgement else None,
        **(judgement.document() if judgement else {"verdict": MISSED, "fraction": None}),
        "required": judgement.demands_document() if judgement else [],
        **_unchanged_document(design),
        "effects": [
            {
                "path": each.path,
                "changes": plain_settings(each.changes),
                "fraction": each.met and each.met.document(),
                "change": each.compared and list(each.compared.difference),
            }
            for each in design.effects
        ],
        "front": [
            {
                "changes": plain_settings(each.point),
                "settings": plain_settings(each.race.judgement.settings),
                "size_m3": each.size,
                "fraction": each.race.judgement.fraction.value,
                "devices": int(each.race.judgement.meets.size),
                "settling_time_s": {
                    "p50": finite(each.race.judgement.time(0.5)),
                    "p90": finite(each.race.judgement.time(0.9)),
                },
                "energy_J": finite(each.race.gas),
            }
            for each in design.front
        ],
        **({"endurance": design.endurance.document()} if design.endurance else {}),
        "ranking": design.ranking.document(),
        **design.rows().document(),
    }


def _quantities(design: Design) -> Iterator[Quantity]:
    judgement = design.judgement
    if judgement is not None:
        name = "devices that meet what is required"
        yield Quantity.of_fraction(judgement.fraction, key="fraction_met", name=name)
        yield from reported_quantities(judgement)
        yield Quantity(key="size", name="cylinder around the chambers", value=design.size, unit="m^3")
        yield Quantity(key="reach", name="cancels in any direction", value=design.reach, unit="kg m")
        rotor = balancer_of(design.given).rotor()
        if rotor.runout is None:
            least = max(design.needed - rotor.limit / abs(rotor.influence), 0.0)
            yield Quantity(key="least_reach", name="needed to come to the limit", value=least, unit="kg m")
    yield Quantity(key="needed_unbalance", name="initial unbalance", value=design.needed, unit="kg m")


def verdict_findings(scene: SceneFile, point: Point, judgement: Judgement) -> Iterator[Finding]:
    """Findings on the verdict of a design, with its changes of the scene, and on the settling times."""
    changes = {path: value for path, value in point.items() if isinstance(value, float | int | str)}
    code = CODES[judgement.verdict] + if_exact(scene, judgement)
    yield Finding(code=code, values=judgement.sentence_values, change=changes)
    yield from time_findings(judgement)


def _findings(design: Design) -> Iterator[Finding]:
    static, judgement = design.static, design.judgement
    counted = {"points": static.points, "able": static.able, "raced": design.raced}
    if judgement is None:
        reach = 0.0 if math.isnan(static.reach) else static.reach
        values = {**counted, "reach": reach, "needed": design.needed, "share": reach / design.needed}
        allowed = static.points - len(static.refusals)
        without = "design_none_flows" if allowed else "design_all_refused"
        yield Finding(code="design_none_able" if reach else without, values={**values, "allowed": allowed})
        yield from _refusals(static.refusals, static.points)
        return
    yield from verdict_findings(design.given, design.point, judgement)
    yield from reported_findings(judgement)
    if design.endurance is not None:
        yield design.endurance.finding
    if design.holding is not None and design.holding.finding is not None:
        yield design.holding.finding
    yield Finding(code="design_looked", values=counted)
    yield from _refusals(static.refusals, static.points)
    if design.succeeded:
        if design.smaller is not None:
            size, share = design.smaller
            values = {"less": 1 - size / design.size, "share": share.value, "of": share.of}
            yield Finding(code="design_smaller", values=values)
        if design.doubt is not None:
            yield Finding(code="design_doubt", values={"doubt": design.doubt})
    else:
        yield from misses(judgement, design.ranking)
    # Keys at an end of their range, and `vary` with a wider range if the end is a default.
    if design.assumed:
        name, lag = design.space.names(design.point)[VALVE], float(design.point["gas.valve_lag"])
        yield Finding(code="design_lag", values={"name": name, "lag": lag})
    for each in design.effects if design.succeeded else ():
        required = judgement.required_fraction
        if each.path == PRESSURE and each.met is not None and each.met.verdict(required) == MISSED:
            values = {"pressure": each.changes[PRESSURE], "share": each.met.value, "of": each.met.of}
            yield Finding(code="design_pressure", values={**values, "asked": required})
    code, default = _EDGES[design.succeeded]
    for path, ends in (pair for axis in design.space.axes for pair in axis.ranges.items()):
        value = float(design.point[path])
        for low, end in ((True, ends.low), (False, ends.high)):
            if abs(value - end) <= _EDGE_FRACTION * abs(end):
                edge: dict[str, Value] = {"path": path, "end": setting_text(path, end)}
                if (wider := design.space.wider(path, low=low)) is None:
                    yield Finding(code=code, values=edge)
                else:
                    yield Finding(code=default, values=edge | {"vary": wider})
                break


def _refusals(texts: Sequence[str], points: int) -> Iterator[Finding]:
    """Finding on designs that the checks of a scene refuse: their number, and the most frequent reason."""
    # Sentences on one reason differ only in numbers and units; words of four letters or more identify it.
    reasons = [tuple(re.findall("[a-z_]{4,}", text)) for text in texts]
    for reason, most in Counter(reasons).most_common(1):
        values = {"count": len(texts), "points": points, "reasons": len(set(reasons)), "most": most}
        text = texts[reasons.index(reason)]
        yield Finding(code="design_refused", values={**values, "text": text})


def misses(judgement: Judgement, ranking: Ranking) -> Iterator[Finding]:
    """Findings on demands that too few devices meet, the worst first, each with the value reached."""
    parts = (judgement.required_fraction, 0.5)
    order = sorted(judgement.demands, key=lambda each: judgement.fraction_of(each).value)
    for i, demand in enumerate(order):
        share = judgement.fraction_of(demand).value
        if i and share >= judgement.required_fraction:
            break
        part = next((each for each in parts if math.isfinite(_reached(judgement, demand, each))), parts[0])
        reached = _reached(judgement, demand, part)
        values: dict[str, Value] = {
            "what": demand.code.replace("_", " "),
            "required": f"{demand.sense} {format_given(demand.required, demand.unit, digits=4)}",
            "share": share,
            "asked": part,
            "reached": format_given(reached, demand.unit, digits=3) if math.isfinite(reached) else MISSING,
        }
        yield Finding(code="design_demand" if math.isfinite(reached) else "design_demand_open", values=values)
    if causes := judgement.causes:
        yield Finding(code="tuned_causes", values={"causes": causes})
    yield from ranking.findings()


def _reached(judgement: Judgement, demand: Demand, fraction: float) -> float:
    """Value of a demand's outcome that a fraction of the devices reaches."""
    values = np.sort(getattr(judgement.outcomes, demand.outcome))
    count = max(math.ceil(fraction * values.size), 1)
    return float(values[-count] if demand.sense == AT_LEAST else values[count - 1])


def _keys_table(design: Design, judgement: Judgement) -> Table:
    """Table of the keys that a drawing and a controller need."""
    rows = [
        (
            path,
            setting_text(path, raw_value_at(design.given, path)),
            setting_text(path, value),
            design.space.range_text(path) if path in design.space.paths else "follows",
        )
        for path, value in design.point.items()
        if value is not None
    ]
    parts = design.space.parts
    rows[:0] = [
        (part, "", name, ", ".join(parts[part].names))
        for part, name in design.space.names(design.point).items()
    ]
    rows += [
        (path, setting_text(path, raw_value_at(design.given, path)), setting_text(path, value), "by runs")
        for path, value in judgement.settings.items()
    ]
    return Table(caption="Design", heads=("key", "the scene's", "designed", "among"), rows=rows)


def _unchanged_document(design: Design) -> dict[str, Any]:
    """The design's gas and the results of the scene's own disc, for JSON, SI; empty where the size varies."""
    if design.unchanged is None or design.judgement is None:
        return {}
    unchanged, reach = design.unchanged
    before = {**unchanged.document(), "energy_J": _gas(unchanged), "reach_kg_m": reach}
    return {"energy_J": _gas(design.judgement), "unchanged": before}


def _gas(judgement: Judgement) -> float | None:
    """Median of the energy of the gas of the devices that settle, J."""
    energies = judgement.outcomes.energy[judgement.outcomes.settled]
    return finite(float(np.median(energies))) if energies.size else None


def _unchanged_table(design: Design) -> Iterator[Table]:
    """Table of the scene's own disc with its own settings beside the design; none where the size varies."""
    if design.unchanged is None or design.judgement is None:
        return
    unchanged, reach = design.unchanged
    valve = "" if raw_value_at(design.given, "gas.conductance") else ", with an ideal valve"
    pairs = ((f"the scene's own{valve}", unchanged, reach), ("designed", design.judgement, design.reach))
    rows = [
        (
            name,
            percent(judgement.fraction.value, digits=3),
            *(format_given(time, "s", digits=3) for time in judgement.settling_times.values()),
            format_given(_gas(judgement), "J", digits=3),
            format_given(reach, "kg m", digits=3),
        )
        for name, judgement, reach in pairs
    ]
    heads = ("", "devices that meet all", "half within", "90 % within", "gas, median", "cancels")
    yield Table(caption="Beside the scene's own disc and settings", heads=heads, rows=rows)


def _effects_table(design: Design) -> Table:
    rows = []
    compared, devices = [(e.met, e.compared) for e in design.effects if e.met and e.compared], "devices"
    for met, pairs in compared[:1]:
        devices = f"{met.of} devices"
        rows.append(("unchanged", "", _per_cent(met.value - pairs.difference[0]), ""))
    for each in design.effects:
        instead = (
            design.space.names({**design.point, **each.changes})[each.path]
            if each.path in design.space.parts
            else setting_text(each.path, each.changes[each.path])
        )
        text = "no such design" if each.met is None else _per_cent(each.met.value)
        change = ""
        if each.compared is not None:
            mean, half = each.compared.difference
            points = (100 * mean, 100 * (mean - half), 100 * (mean + half))
            change = "{:+z.1f} ({:+z.1f} to {:+z.1f})".format(*points)
        rows.append((each.path, instead, text, change))
    heads = ("key", "instead", "devices that meet all", "change in percentage points, 95 %")
    caption = f"One key changed, the settings as they are, on the same {devices}"
    return Table(caption=caption, heads=heads, rows=rows)


def _per_cent(fraction: float) -> str:
    """A fraction to a tenth of a percentage point, as the changes beside it."""
    return with_unit(f"{100 * fraction:.1f}", "%")


def _front_table(design: Design) -> Table:
    required_fraction = REQUIRED_FRACTION if design.judgement is None else design.judgement.required_fraction
    by_valve = [path for axis in design.space.axes if any(axis.names) for path in axis.paths]
    paths = [path for path in design.space.paths if path not in by_valve]
    rows = [
        (
            format_given(each.size, "m^3", digits=4),
            format_given(finite(each.race.judgement.time(required_fraction)), "s", digits=3),
            format_given(finite(each.race.gas), "J", digits=3),
            *design.space.names(each.point).values(),
            *(setting_text(path, each.point.get(path)) for path in paths),
        )
        for each in design.front
    ]
    columns = (path.rpartition(".")[2].replace("_", " ") for path in paths)
    heads = ("size", f"{percent(required_fraction)} within", "gas, median", *design.space.parts, *columns)
    return Table(
        caption="Others, none of which is better in everything; times and gas of few devices",
        heads=heads,
        rows=rows,
    )
