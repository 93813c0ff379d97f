"""The report of a scene with two eccentric masses: its sections, each a list of parts."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from ringbalance.controller.eccentric_mass.study import DRAWS
from ringbalance.reports import summary
from ringbalance.reports.figures.eccentric import (
    DEVIATIONS,
    amplitude_over_speed,
    amplitude_over_time,
    friction_estimates,
    imbalance_estimate,
    mass_angles,
    sampled_poles,
)
from ringbalance.reports.figures.operation import requirement_bars
from ringbalance.reports.pages import credibility, document, measured
from ringbalance.reports.pages.cases import case_view
from ringbalance.reports.prose import input_name, named_with_origin, traced
from ringbalance.reports.section import Cells, Record, Section, Table
from ringbalance.reports.summary import OPEN
from ringbalance.results.numbers import (
    MISSING,
    THIN_SPACE,
    display_unit,
    given,
    number,
    percent,
    shown,
    with_unit,
)

BALANCER: Final = "eccentric_mass"
_MODEL: Final = "Plant and filters are models; no measurement of this machine is compared with here."
_USE: Final = (
    "Use: for choosing masses, drives and filters before they are built, and for planning measurements. Not "
    "as proof of safety, not in place of a balancing test to ISO 21940-11, and for a vertical shaft only: "
    "gravity along the track is left out."
)
_STATED: Final = (
    f"Intervals (95 %) are those of {DRAWS} runs with all inputs drawn from the uncertainties that the scene "
    "states, other noise of the sensors, and the controller as configured. As the scene stands, an amplitude "
    "is often the least of them, because there the controller knows its rotor exactly. What the models leave "
    "out is not in them."
)
_UNSTATED: Final = (
    "The scene states no uncertainties: every result holds for exactly its values. [uncertainty] in the "
    "scene file states them."
)
_KEY: Final = re.compile(r"\b[a-z_]+\.[a-z_]+\b")
"""A key of the scene file, such as supervisor.limit."""
_CAUSES: Final = 2
"""Inputs that a row names as those it hangs on most."""


def _parts(*parts: tuple[str, Any]) -> Record:
    """What the template sets in turn: kinds and contents, without the empty ones."""
    return {"parts": [(kind, content) for kind, content in parts if content]}


def _summary(_own: Record, evidence: Record) -> Record:
    run, locked, rows = evidence["closed_loop"]["balanced"], evidence["locked"], evidence["requirements"]
    ratio = percent(run["residual_ratio"])
    worst = [
        traced(shown(each["worst_amplitude_m"], "m", digits=3), f"{path}.worst_amplitude_m")
        for each, path in ((run, "closed_loop.balanced"), (locked, "locked"))
    ]
    stated = any(row["achieved_interval"] for row in rows)
    return _parts(
        ("lead", summary.decided([(row["quantity"], row["verdict"]) for row in rows])),
        (
            "text",
            f"As the scene stands: {run['status'].rstrip('.')}.{_drawn_settle(rows)} "
            f"The largest amplitude of the run is {worst[0]}; with the masses locked where they start it is "
            f"{worst[1]}. At the end {ratio} of the vibration without balancing is left. The drives take at "
            f"most {_peak(run)}.",
        ),
        *(("alert", f"{text[0].upper()}{text[1:].rstrip('.')}.") for text in run["warnings"]),
        ("table", _requirements(rows, evidence)),
        ("items", _actions(rows)),
        ("text", _USE),
        ("figure", requirement_bars(map(_bar, rows))),
        ("items", [_MODEL, _STATED if stated else _UNSTATED, _origins(evidence["scene"]["table"])]),
    )


def _drawn_settle(rows: list[Record]) -> str:
    """How many of the runs with drawn inputs settle, where not all of them do; else empty."""
    for place, row in enumerate(rows):
        if row["quantity"] == "settling time" and row["reached"] < 1.0:
            share = traced(percent(row["reached"]), f"requirements.{place}.reached")
            return f" Of the runs with inputs drawn from their uncertainty {share} settle."
    return ""


def _peak(run: Record) -> str:
    """Largest voltage of a drive in the run."""
    return traced(shown(run["peak_voltage_V"], "V", digits=3), "closed_loop.balanced.peak_voltage_V")


def _actions(rows: list[Record]) -> list[str]:
    """What to find out first, where the stated uncertainties leave a requirement open."""
    found: dict[str, list[str]] = {}
    for row in rows:
        if row["verdict"] == OPEN and (causes := _causes(row)):
            found.setdefault(", ".join(sorted(map(input_name, causes))), []).append(row["quantity"])
    return [
        f"Determine more closely: {causes}. That decides whether these requirements are met: "
        f"{', '.join(names)}."
        for causes, names in found.items()
    ]


def _causes(row: Record) -> list[str]:
    """Paths of the inputs that a row hangs on most: those that lose it, then the largest effects."""
    effects = {path: max(both) for path, both in row["effects"].items()}
    largest = max(effects.values(), default=0.0)
    ranked = sorted(effects, key=lambda path: -effects[path])
    telling = [path for path in ranked if effects[path] > 0.1 * largest]
    return list(dict.fromkeys([*row["lost"], *telling]))[: max(_CAUSES, len(row["lost"]))]


def _origins(rows: list[Record]) -> str:
    counts = Counter(row["origin"] for row in rows)
    told = ", ".join(f"{count} {origin}" for origin, count in counts.most_common())
    return (
        f"Of the {len(rows)} values of the scene: {told}. Results hold only as far as the assumed values do."
    )


def _bar(row: Record) -> Record:
    low, high = row["achieved_interval"] or (row["achieved"], row["achieved"])
    return {
        "label": row["quantity"],
        "required": row["required"],
        "reached": row["achieved"],
        "low": low,
        "high": high,
        "at_least": row["sense"] == "at least",
        "verdict": row["verdict"],
    }


def _requirements(requirements: list[Record], evidence: Record) -> Table:
    def cells(place: int, row: Record) -> Cells:
        path = f"requirements.{place}"
        unit = row["unit"] or "1"
        needed = _span(row["required_interval"], unit)
        return (
            f"{row['quantity'][0].upper()}{row['quantity'][1:]}",
            f"{row['sense']} {traced(given(row['required'], unit, digits=3), f'{path}.required')}"
            f"{f' ({needed})' if needed else ''}",
            _KEY.sub(lambda match: input_name(match[0]), row["set_by"]),
            _reached(row, f"{path}.achieved"),
            _never(row, f"{path}.reached") or _span(row["achieved_interval"], unit) or MISSING,
            row["verdict"],
            ", ".join(named_with_origin(evidence, path) for path in _causes(row)),
        )

    return Table(
        caption="Requirements: what sets each, what this run and these loops come to, with its 95 % "
        "interval, and the inputs on which it depends most. Where only part of the interval, or of the runs "
        "with inputs drawn from their uncertainty, meets a requirement, the verdict cannot be told. A "
        "settling time counts where the vibration stays within the limit to the end of the run, any run-up "
        "included.",
        heads=("Quantity", "Required", "Set by", "Reached", "Interval", "Verdict", "Depends on"),
        rows=[cells(place, row) for place, row in enumerate(requirements)],
        style="words",
    )


def _reached(row: Record, path: str) -> str:
    """What the scene as it stands comes to; said where drawn inputs may not come to anything."""
    if row["achieved"] is None:
        return "not reached"
    told = traced(shown(row["achieved"], row["unit"] or "1", digits=3), path)
    return f"{told} with the scene’s values" if _misses(row) else told


def _never(row: Record, path: str) -> str:
    """How many of the drawn runs come to a result that not all come to; else empty."""
    if row["achieved"] is None or not _misses(row):
        return ""
    if row["reached"] == 1.0:
        return "none: with an input at the end of its own interval the run never gets there"
    share = traced(percent(row["reached"]), path)
    return f"none: of the runs with drawn inputs {share} get there, the others never do"


def _misses(row: Record) -> bool:
    return row["reached"] < 1.0 or bool(row["lost"])


def _span(interval: Sequence[float] | None, unit: str) -> str:
    """Both ends in one unit; empty where there is no interval, or none that three digits show."""
    if interval is None:
        return ""
    display = display_unit(unit, *interval)
    low, high = (number(end * display.factor, digits=3) for end in interval)
    if low == high:
        return ""
    return with_unit(f"up to {high}" if interval[0] == 0 else f"{low} to {high}", display.symbol)


def _run(_own: Record, evidence: Record) -> Record:
    run, locked = evidence["closed_loop"]["balanced"], evidence["locked"]
    varies = max(run["speed_rad_s"]) > min(run["speed_rad_s"])
    return _parts(
        ("figure", amplitude_over_speed(run, locked) if varies else None),
        ("figure", amplitude_over_time(run, locked)),
        ("table", _stages(run)),
    )


def _stages(run: Record) -> Table:
    def cells(place: int, stage: Record) -> Cells:
        path = f"closed_loop.balanced.stages.{place}"
        amplitude = float(np.interp(stage["end_s"], run["time_s"], run["amplitude_m"]))
        times = (traced(shown(stage[k], "s", digits=4), f"{path}.{k}") for k in ("start_s", "end_s"))
        return stage["name"].replace("_", " "), *times, shown(amplitude, "m", digits=3)

    return Table(
        caption="Stages of the strategy.",
        heads=("Stage", "From", "To", "Amplitude at its end"),
        rows=[cells(place, stage) for place, stage in enumerate(run["stages"])],
    )


def _estimates(_own: Record, evidence: Record) -> Record:
    run, truth = evidence["closed_loop"]["balanced"], evidence["truth"]
    return _parts(
        (
            "pair",
            [
                imbalance_estimate(run, truth["unbalance_kg_m"]),
                friction_estimates(run, tuple(truth["friction_arm_m"])),
            ],
        ),
        ("table", _estimate_table(run["estimates"], truth)),
        (
            "text",
            ""
            if run["innovation"] is None
            else "Mean square of the imbalance filter’s normalised innovations: "
            f"{number(run['innovation'], digits=3)}; it is 1 for a filter whose model is true.",
        ),
    )


def _estimate_table(estimates: Record, truth: Record) -> Table:
    """Final estimates with their 95 % half-widths beside the true values, errors in standard deviations."""
    true = truth["unbalance_kg_m"] * np.array([math.cos(truth["phase_rad"]), math.sin(truth["phase_rad"])])
    covariance = np.asarray(estimates["imbalance_covariance"][-1])
    covariance = covariance + np.asarray(estimates["imbalance_rotor_covariance"])
    last = [row[-1] for row in estimates["imbalance_kg_m"]]
    arms, variances = ([row[-1] for row in estimates[key]] for key in ("friction_arm_m", "friction_variance"))
    plant = truth["friction_arm_m"]
    entries = [
        ("imbalance along x", "kg m", last[0], covariance[0, 0], true[0]),
        ("imbalance along y", "kg m", last[1], covariance[1, 1], true[1]),
        *(
            (f"friction arm of mass {place + 1}", "m", arms[place], variances[place], plant[place])
            for place in (0, 1)
        ),
    ]

    def cells(name: str, unit: str, value: float, variance: float, right: float) -> Cells:
        deviation = math.sqrt(variance)
        error = number((value - right) / deviation, digits=2) if deviation > 0 else MISSING
        told = shown(float(value), unit, DEVIATIONS * deviation or None)
        return name, told, shown(float(right), unit, digits=4), error

    return Table(
        caption="Estimates at the end of the run with their 95 % half-widths, and the plant’s values. The "
        "imbalance’s hold the filter’s noise and what the scene states of rotor and masses. The error is in "
        "standard deviations.",
        heads=("Quantity", "Estimate", "In the plant", "Error"),
        rows=[cells(*entry) for entry in entries],
    )


def _loops(_own: Record, evidence: Record) -> Record:
    tuning = evidence["tuning"]
    return _parts(
        ("text", f"{tuning['status'][0].upper()}{tuning['status'][1:]}.{_drawn(tuning)}"),
        ("table", _loop_table(tuning["loops"])),
        ("pair", [sampled_poles(tuning["loops"]), mass_angles(evidence["closed_loop"]["balanced"])]),
    )


def _drawn(tuning: Record) -> str:
    """What the runs with drawn inputs are judged by; empty without any."""
    if not tuning.get("runs"):
        return ""
    return (
        f" These runs, with inputs drawn from their uncertainty, are judged over their first "
        f"{shown(tuning['span_s'], 's', digits=3)}, before the speed changes: what a run-up does afterwards "
        "is in the requirements."
    )


def _loop_table(loops: list[Record]) -> Table:
    return Table(
        caption="The drives’ loops as they run, sampled: stable when the largest pole is below 1. "
        "The largest value is a ceiling, not a setting: it leaves a gain margin of two.",
        heads=(
            "Loop",
            "Key",
            "Value",
            "Largest\nvalue",
            "Largest\npole",
            "Gain\nmargin",
            "Hold of the\nvoltage",
        ),
        rows=[
            (
                loop["name"],
                loop["key"],
                *(
                    traced(
                        with_unit(number(loop[key], digits=digits), unit.replace("*", THIN_SPACE)),
                        f"tuning.loops.{place}.{key}",
                    )
                    for key, digits, unit in (
                        ("value", 3, loop["unit"]),
                        ("recommended", 3, loop["unit"]),
                        ("radius", 4, ""),
                        ("gain_margin", 3, ""),
                    )
                ),
                f"at most {shown(loop['recommended_step_s'], 's', digits=2)}",
            )
            for place, loop in enumerate(loops)
        ],
        style="dense",
    )


def _claims(_own: Record, evidence: Record) -> Record:
    cases = summary.claims(evidence, paper=evidence["balancer"])
    counts = ", ".join(summary.counted(cases))
    return _parts(
        (
            "text",
            f"Of {len(cases)} claims of the eccentric-mass paper {counts}. They are judged on its own rotor.",
        ),
        ("claims", [{**case_view(case), "elsewhere": False} for case in cases]),
    )


def _cases(_own: Record, evidence: Record) -> Record:
    return _parts(("cases", [case_view(c) for c in summary.claims(evidence, paper=evidence["balancer"])]))


def _scene(_own: Record, evidence: Record) -> Record:
    return _parts(("source", evidence["scene"]["text"]))


SECTIONS: Final = (
    Section(name="summary", title="Decision", place="report", show=_summary, in_parts=True),
    Section(name="run", title="Run-up and stages", place="report", show=_run, in_parts=True),
    Section(name="estimates", title="Estimates", place="report", show=_estimates, in_parts=True),
    Section(
        name="loops",
        title="Drives: poles, margins and what they do",
        place="report",
        show=_loops,
        in_parts=True,
    ),
    Section(
        name="claims", title="Claims of the eccentric-mass paper", place="report", show=_claims, in_parts=True
    ),
    credibility.SECTION,
    Section(name="parameters", title="Parameters and their origin", place="report"),
    document.SECTION,
    Section(name="cases", title="Claims: evidence and doubts", show=_cases, in_parts=True),
    measured.SECTION,
    Section(name="scene", title="Scene file", show=_scene, in_parts=True),
)
