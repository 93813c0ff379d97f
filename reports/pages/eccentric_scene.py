"""The report of a scene with two eccentric masses: its sections, each a list of parts."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any, Final

import numpy as np

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
from ringbalance.reports.numbers import MISSING, number, percent, shown
from ringbalance.reports.pages import credibility, document
from ringbalance.reports.pages.cases import case_view
from ringbalance.reports.section import Cells, Record, Section, Table

BALANCER: Final = "eccentric_mass"
_BASIS: Final = (
    "Plant and filters are models; no measurement of this machine is compared with here.",
    "± and bands are 95 % by the filters’ own covariances: what their models leave out is not in them.",
)


def _parts(*parts: tuple[str, Any]) -> Record:
    """What the template sets in turn: kinds and contents, without the empty ones."""
    return {"parts": [(kind, content) for kind, content in parts if content]}


def _summary(_own: Record, evidence: Record) -> Record:
    run, locked = evidence["closed_loop"]["balanced"], evidence["locked"]
    ratio = percent(run["residual_ratio"])
    worst = [shown(each["worst_amplitude_m"], "m", digits=3) for each in (run, locked)]
    return _parts(
        ("lead", f"{run['status'][0].upper()}{run['status'][1:].rstrip('.')}."),
        (
            "text",
            f"The largest amplitude on the way is {worst[0]}; with the masses locked where they start it is "
            f"{worst[1]}. At the end {ratio} of the vibration without balancing is left.",
        ),
        *(("alert", f"{text[0].upper()}{text[1:].rstrip('.')}.") for text in run["warnings"]),
        ("table", _requirements(evidence["requirements"])),
        ("figure", requirement_bars(_rows(evidence["requirements"]))),
        ("items", [*_BASIS, _origins(evidence["scene"]["table"])]),
    )


def _origins(rows: list[Record]) -> str:
    counts = Counter(row["origin"] for row in rows)
    told = ", ".join(f"{count} {origin}" for origin, count in counts.most_common())
    return (
        f"Of {len(rows)} values of the scene: {told}. What follows from assumed values holds for them alone."
    )


def _rows(requirements: list[Record]) -> list[Record]:
    return [
        {
            "label": row["quantity"],
            "required": row["required"],
            "reached": row["achieved"],
            "uncertainty": None,
            "unit": row["unit"] or "1",
            "at_least": row["sense"] == "at least",
        }
        for row in requirements
    ]


def _requirements(requirements: list[Record]) -> Table:
    def cells(row: Record) -> Cells:
        unit, reached = row["unit"] or "1", row["achieved"]
        return (
            row["quantity"],
            f"{row['sense']} {shown(row['required'], unit, digits=3)}",
            MISSING if reached is None else shown(reached, unit, digits=3),
            "met" if row["met"] else "not met",
        )

    return Table(
        caption="What is required, and what this run and these loops come to.",
        heads=("Quantity", "Required", "Reached", "Verdict"),
        rows=[cells(row) for row in requirements],
        style="",
    )


def _run(_own: Record, evidence: Record) -> Record:
    run, locked = evidence["closed_loop"]["balanced"], evidence["locked"]
    varies = max(run["speed_rad_s"]) > min(run["speed_rad_s"])
    return _parts(
        ("figure", amplitude_over_speed(run, locked) if varies else None),
        ("figure", amplitude_over_time(run, locked)),
        ("table", _stages(run)),
    )


def _stages(run: Record) -> Table:
    def cells(stage: Record) -> Cells:
        amplitude = float(np.interp(stage["end_s"], run["time_s"], run["amplitude_m"]))
        times = (shown(stage[key], "s", digits=4) for key in ("start_s", "end_s"))
        return stage["name"].replace("_", " "), *times, shown(amplitude, "m", digits=3)

    return Table(
        caption="Stages of the strategy.",
        heads=("Stage", "From", "To", "Amplitude at its end"),
        rows=[cells(stage) for stage in run["stages"]],
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
        "error is in standard deviations.",
        heads=("Quantity", "Estimate", "In the plant", "Error"),
        rows=[cells(*entry) for entry in entries],
    )


def _loops(_own: Record, evidence: Record) -> Record:
    tuning = evidence["tuning"]
    return _parts(
        ("text", f"{tuning['status'][0].upper()}{tuning['status'][1:]}."),
        ("table", _loop_table(tuning["loops"])),
        ("pair", [sampled_poles(tuning["loops"]), mass_angles(evidence["closed_loop"]["balanced"])]),
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
                    f"{number(loop[key], digits=3)} {loop['unit']}".rstrip()
                    for key in ("value", "recommended")
                ),
                number(loop["radius"], digits=4),
                number(loop["gain_margin"], digits=3),
                f"at most {shown(loop['recommended_step_s'], 's', digits=2)}",
            )
            for loop in loops
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
    Section(name="summary", title="In short", place="report", show=_summary, in_parts=True),
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
    Section(name="scene", title="Scene file", show=_scene, in_parts=True),
)
