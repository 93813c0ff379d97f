"""What the device must do, what it does, and whether that can be told: one row a requirement."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from matplotlib.axes import Axes

from ringbalance.controller.liquid_ring.loop_factor import STAYING_DEVIATIONS
from ringbalance.reports.figure import FIFTH, INK, PAPER, THIRD, Drawing, draw
from ringbalance.reports.prose import resting
from ringbalance.reports.section import Record
from ringbalance.reports.summary import (
    LIKELY,
    above,
    below,
    decided,
    ideal_valve,
    line_verdict,
    runs_settled,
    settles,
    tuning_of,
    what_enlarges,
    worst,
)
from ringbalance.reports.traced import evidence_at, read, traced, untraced
from ringbalance.results.numbers import given, number, percent, shown
from ringbalance.results.requirements import MET, MISSED, OPEN, UNASKED
from ringbalance.results.result import Table
from ringbalance.scene import Scene

CAPACITY: Final = "Correction capacity in any direction"
STANDING: Final = "Vibration up to which the scene’s valve-open times transfer no liquid"
SMALLEST: Final = "Smallest correction that the valve can give"
_NONE: Final = "the scene asks for none"
_WIDEST: Final = 2.5
"""Times the requirement at which a bar is cut off."""


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """One row of the table."""

    name: str
    wanted: str
    result: str
    verdict: str
    rests: str
    """Inputs behind it that nobody gave, with their origin."""
    required: float | None = None
    """In SI units; None where there is none to draw."""
    reached: float | None = None
    uncertainty: float = 0.0
    low: float | None = None
    high: float | None = None
    """Ends of what is reached, where they are others than plus and minus the uncertainty."""
    at_least: bool = True
    """Whether more than required is better."""


def requirement_record(scene: Scene) -> Record:
    """What is required of a scene's balancer, SI; None where nothing is stated."""
    wanted, rotor = scene.requirement, scene.rotor
    return {
        "settling_time_s": wanted.settling_time,
        "residual_m": wanted.residual if wanted.residual is not None else scene.controller.limit,
        "grade_m_s": wanted.grade,
        "correction_moment_kg_m": wanted.correction_moment,
        "rotor_mass_kg": rotor.mass,
        "rotor_speed_rad_s": rotor.speed,
        "grade_at_residual_m_s": _grade(scene),
        "residual_moment_kg_m": _residual(scene) / rotor.influence_coefficient,
    }


def _residual(scene: Scene) -> float:
    wanted = scene.requirement.residual
    return scene.controller.limit if wanted is None else wanted


def _grade(scene: Scene) -> float | None:
    """Balance quality grade of the residual, G = U omega/m, m/s (ISO 21940-11:2016)."""
    if scene.rotor.mass is None:
        return None
    return _residual(scene) / scene.rotor.influence_coefficient * scene.rotor.speed / scene.rotor.mass


def requirements(evidence: Record) -> list[Requirement]:
    """The requirements in the order in which a designer meets them."""
    every = (_capacity, _gas_pressure, _scene_gain, _recommended_gain, _settling, _residual_row)
    return [
        row for make in (*every, smallest_row, _standing, _grade_row) if (row := make(evidence)) is not None
    ]


def requirement_table(rows: Iterable[Requirement]) -> Table:
    """As printed."""
    return Table(
        caption="Requirements. Undecided: the requirement lies inside the result’s 95 % interval; what "
        "rests on inputs that nobody gave holds only if they do.",
        heads=("Requirement", "Required", "Result", "Verdict", "Rests on"),
        rows=[(row.name, row.wanted, row.result, row.verdict, row.rests) for row in rows],
        style="words",
    )


def requirement_figure(rows: Iterable[Requirement]) -> Drawing | None:
    """What is required against what is reached; None without numbers."""
    return requirement_bars(
        {
            "label": untraced(row.name),
            "required": row.required,
            "reached": row.reached,
            "low": row.reached - row.uncertainty if row.low is None else row.low,
            "high": row.reached + row.uncertainty if row.high is None else row.high,
            "at_least": row.at_least,
            "verdict": row.verdict,
        }
        for row in rows
        if row.reached is not None
    )


def requirement_bars(rows: Iterable[Record]) -> Drawing | None:
    """What is required against what is reached, each over its requirement, with 95 % intervals.

    Args: `rows`: `label`, `required`, `reached`, `low` and `high` (ends of what is reached), `at_least`
    (whether more is better) and `verdict` of each; a bar beyond the axis ends in its number.
    Returns: The figure; None without rows.
    """
    kept = [row for row in rows if row["required"] and row["reached"] is not None]
    if not kept:
        return None
    end = min(1.08 * max(1.0, *(row["high"] / row["required"] for row in kept)), _WIDEST)

    def paint(axes: Axes) -> None:
        for place, row in enumerate(kept):
            _requirement_bar(axes, place, row, end)
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
        axes.grid(visible=False, axis="y")

    return draw(
        "requirements",
        paint,
        x=("reached over required", "1"),
        xlim=(0, end),
        ylim=(len(kept) - 0.6, -0.95),
        columns=0,
        wide=True,
        height=0.8 + 0.44 * len(kept),
    )


def _requirement_bar(axes: Axes, place: int, row: Record, end: float) -> None:
    ratio, low, high = (row[key] / row["required"] for key in ("reached", "low", "high"))
    colour = {"met": THIRD, "not met": PAPER}.get(row["verdict"], FIFTH)
    axes.barh(place, min(ratio, end), height=0.42, color=colour, alpha=0.75, linewidth=0)
    if high > low:
        axes.plot([low, min(high, end)], [place, place], color=INK, linewidth=1.2)
        caps = [each for each in (low, high) if each < end]
        axes.plot(caps, [place] * len(caps), "|", color=INK, markersize=6)
    axes.plot([1, 1], [place - 0.24, place + 0.24], color=INK, linewidth=1.8)
    if high > end:
        start = "up to " if ratio <= end else ("" if high <= ratio else f"{number(ratio, digits=2)} to ")
        beyond = f"{start}{number(max(ratio, high), digits=2)} \u25b8"
        axes.text(0.995 * end, place - 0.28, beyond, ha="right", va="bottom", color=INK)
    sense = "at least" if row["at_least"] else "at most"
    axes.text(0.0, place - 0.28, f"{row['label']} ({sense}): {row['verdict']}", va="bottom", color=INK)


def decision(rows: Iterable[Requirement]) -> str:
    """One sentence: how many requirements are met, and which are not."""
    asked = (row for row in rows if row.verdict != UNASKED)
    return decided([(row.name[0].lower() + row.name[1:], row.verdict) for row in asked])


def _capacity(evidence: Record) -> Requirement | None:
    rest, own = evidence["calibration"].get("residual_liquid"), evidence.get("summary")
    if not rest or not own:
        return None
    stated = (own.get("requirement") or {}).get("correction_moment_kg_m") is not None
    path = "summary.requirement.correction_moment_kg_m" if stated else "summary.needed_moment_kg_m"
    width = 0.0 if stated else own.get("needed_uncertainty_kg_m") or 0.0
    reach, total = "calibration.residual_liquid.reach_kg_m", rest["reach_uncertainty"]
    needed = evidence_at(evidence, path)
    both = math.hypot(total, width)
    return Requirement(
        name=CAPACITY,
        wanted=f"at least {read(evidence, path, 'kg m', width=width)}",
        result=read(evidence, reach, "kg m", width=total),
        verdict=above(rest["reach_kg_m"], needed, both),
        rests=resting(
            evidence,
            *(() if stated else ("rotor.initial_amplitude",)),
            *("rotor.influence_coefficient", "disc.plate_thickness"),
            "tube.hump_radius" if rest.get("limited_by") == "gas_pressure" else "tube.bore",
        ),
        required=needed,
        reached=rest["reach_kg_m"],
        uncertainty=both,
    )


def more_capacity(rest: Record) -> str:
    """What to do about a capacity that is too small, by what limits it."""
    if rest.get("limited_by") == "gas_pressure":
        return (
            "Raise the gas pressure, and tune again, for the flow becomes faster: at this pressure the gas "
            "stalls before the capacity is used."
        )
    return "Balance the rotor better by hand, or take a larger disc: the capacity has no reserve."


def _gas_pressure(evidence: Record) -> Requirement | None:
    point = evidence["operating_point"]
    starts = point.get("priming_pressure_vented_Pa") is not None
    key = "priming_pressure_vented_Pa" if starts else "stall_pressure_Pa"
    width = point["priming_uncertainty" if starts else "stall_uncertainty"]
    summary, gas = evidence.get("summary") or {}, point["gas_pressure_Pa"]
    own = summary.get("gas_pressure_uncertainty_Pa") or 0.0
    both, crest = math.hypot(width, own), summary.get("crest") if starts else None
    # A crest that nobody gave may lie elsewhere, which moves the pressure by more than any tolerance.
    least, most = crest["priming_pressure_Pa"] if crest else (point[key], point[key])
    ends = (
        read(evidence, f"summary.crest.priming_pressure_Pa.{end}", "Pa", digits=2) for end in (0, 1) if crest
    )
    anywhere = f"; {' to '.join(ends)} wherever the crest may lie" if crest else ""
    verdicts = {above(gas, bound, both) for bound in (least, most)}
    return Requirement(
        name="Gas pressure "
        + ("that lifts the liquid of any fill over the siphon crest" if starts else "above stall"),
        wanted=f"at least {read(evidence, f'operating_point.{key}', 'Pa', width=width)}{anywhere}"
        f"{_at_most(evidence, summary)}",
        result=read(evidence, "operating_point.gas_pressure_Pa", "Pa", width=own),
        verdict=verdicts.pop() if len(verdicts) == 1 else OPEN,
        rests=resting(evidence, "tube.hump_radius", "tube.port_radius", "tube.hump_gas")
        if starts
        else "a tube without siphon crest: the scene names none",
        required=point[key],
        reached=gas,
        uncertainty=both,
        low=gas * point[key] / most - both if most > 0 else None,
        high=gas * point[key] / least + both if least > 0 else None,
    )


def _at_most(evidence: Record, summary: Record) -> str:
    """The pressure from which the valve's smallest correction is too large for the limit."""
    path = "summary.highest_gas_pressure_Pa"
    if summary.get("highest_gas_pressure_Pa") is None:
        return ""
    return f"; at most {read(evidence, path, 'Pa', digits=2)} for the valve’s smallest correction"


def _scene_gain(evidence: Record) -> Requirement | None:
    run = evidence["closed_loop"].get("calibrated")
    if run is None or run.get("loop_factor") is None:
        return None
    limit, width = _staying(run, "closed_loop.calibrated"), run["loop_factor"] * _gain_share(evidence)
    bound = traced(number(run["loop_factor_limit"], digits=3), "closed_loop.calibrated.loop_factor_limit")
    return Requirement(
        name="Loop factor with the scene’s gain",
        wanted=f"at most {limit} for noise to stay within the limit; unstable from {bound}",
        result=read(evidence, "closed_loop.calibrated.loop_factor", "1", width=width),
        verdict=above(_staying_value(run), run["loop_factor"], width),
        rests=resting(evidence, "tube.bore", "rotor.influence_coefficient", "sensor.amplitude_noise"),
        required=_staying_value(run),
        reached=run["loop_factor"],
        uncertainty=width,
        at_least=False,
    )


def _gain_share(evidence: Record) -> float:
    """Relative uncertainty of what a second of gas does, which every loop factor has."""
    return float((tuning_of(evidence).get("margins") or {}).get("gain_uncertainty", 0.0))


def _staying_value(run: Record) -> float:
    return float(run.get("largest_staying_loop_factor") or run["loop_factor_limit"])


def _staying(run: Record, path: str) -> str:
    key = "largest_staying_loop_factor" if run.get("largest_staying_loop_factor") else "loop_factor_limit"
    return traced(number(run[key], digits=3), f"{path}.{key}")


def _recommended_gain(evidence: Record) -> Requirement | None:
    tuning, run = tuning_of(evidence), evidence["closed_loop"].get("calibrated")
    if tuning.get("gain") is None or run is None or tuning.get("loop_factor") is None:
        return None
    width = tuning["loop_factor"] * _gain_share(evidence)
    gain = read(evidence, "summary.tuning.gain", "s/m", digits=2)
    bound = run["loop_factor_limit"]
    return Requirement(
        name=f"Loop factor with the recommended gain of {gain}",
        wanted=f"less than {traced(number(bound, digits=3), 'closed_loop.calibrated.loop_factor_limit')}",
        result=read(evidence, "summary.tuning.loop_factor", "1", width=width),
        verdict=above(bound, tuning["loop_factor"], width),
        rests=resting(evidence, "tube.bore", "rotor.influence_coefficient"),
        required=bound,
        reached=tuning["loop_factor"],
        uncertainty=width,
        at_least=False,
    )


def _settling(evidence: Record) -> Requirement | None:
    tuning = tuning_of(evidence)
    if not tuning.get("runs") or tuning.get("fraction_settled") is None:
        return None
    times = tuning.get("settling_time_s") or {}
    wanted = (evidence["summary"].get("requirement") or {}).get("settling_time_s")
    low, high = tuning["fraction_settled_95"]
    late = wanted is not None and (times.get("p95") or math.inf) > wanted
    judged = MISSED if late or high < LIKELY else (MET if low >= LIKELY else OPEN)
    until = evidence["summary"]["time_limit_s"] if wanted is None else wanted
    # Runs that do not settle at all are judged, whether or not a time is required.
    unasked = wanted is None and times.get("p95") is not None
    return Requirement(
        name="Settling time with the recommended settings",
        wanted=_NONE if unasked else f"at most {given(until, 's')} in {percent(LIKELY)} of runs",
        result=f"{_times(evidence, times)}settled: {runs_settled(tuning)}{ideal_valve(evidence)}",
        verdict=UNASKED if unasked else judged,
        rests=resting(evidence, "tube.bore", "rotor.influence_coefficient", "controller.period"),
        required=wanted,
        reached=times.get("p95"),
        at_least=False,
    )


def _times(evidence: Record, times: Record) -> str:
    """The median and the time within which most have settled, as far as so many have."""
    path, told = "summary.tuning.settling_time_s", []
    if times.get("p50") is not None:
        told.append(f"median {read(evidence, f'{path}.p50', 's', digits=2)}")
    if times.get("p95") is not None:
        told.append(f"{percent(LIKELY)} of runs within {read(evidence, f'{path}.p95', 's', digits=2)}")
    return f"{', '.join(told)}; " if told else ""


def _residual_row(evidence: Record) -> Requirement | None:
    tuning, run = tuning_of(evidence), evidence["closed_loop"].get("calibrated") or {}
    path = "summary.tuning.stationary_deviation_m" if tuning.get("stationary_deviation_m") else ""
    if not path and run.get("stationary_deviation_m"):
        path = "closed_loop.calibrated.stationary_deviation_m"
    wanted = (evidence.get("summary") or {}).get("requirement") or {}
    if not path or wanted.get("residual_m") is None:
        return None
    noise, limit = STAYING_DEVIATIONS * evidence_at(evidence, path), wanted["residual_m"]
    moment = read(evidence, "summary.requirement.residual_moment_kg_m", "kg m", digits=2)
    gain = "the recommended settings" if tuning.get("stationary_deviation_m") else "the scene’s gain"
    alone = below((noise,), limit)
    verdict = worst(alone, line_verdict(evidence), settles(evidence))
    return Requirement(
        name="Residual vibration (zero to peak)",
        wanted=f"at most {given(limit, 'm')}, an unbalance of {moment}",
        result=f"{shown(noise, 'm', digits=2)}: {STAYING_DEVIATIONS:g} standard deviations of what noise "
        f"keeps up with {gain}{what_enlarges(evidence)}",
        verdict=verdict,
        rests=resting(evidence, "sensor.amplitude_noise", "rotor.influence_coefficient"),
        # Where more than noise decides, a bar of the noise would show less than is there.
        required=limit if verdict == alone else None,
        reached=noise,
        at_least=False,
    )


def smallest_row(evidence: Record) -> Requirement | None:
    """The valve's smallest correction; where runs with this valve reach the limit, nothing is asked of it."""
    row = _of_line(evidence, "smallest_correction_m", SMALLEST, bound="largest_correction_m")
    if row is None:
        return None
    verdict = line_verdict(evidence)
    shown_by_runs = "; the runs settle with it" if verdict == MET != row.verdict else ""
    return replace(
        row,
        wanted=f"{row.wanted} for the limit to be sure",
        result=f"{row.result}{shown_by_runs}",
        verdict=UNASKED if shown_by_runs else row.verdict,
    )


def _standing(evidence: Record) -> Requirement | None:
    """With the scene's own gain and offsets, by the dead time: gas fills, and liquid rises to the crest."""
    return _of_line(evidence, "standing_amplitude_m", STANDING)


def _of_line(evidence: Record, key: str, name: str, *, bound: str = "limit_m") -> Requirement | None:
    line = evidence["calibration"].get("gas_line")
    if not line or any(end.get(key) is None for end in line["ends"]):
        return None
    ends = sorted(range(len(line["ends"])), key=lambda i: line["ends"][i][key])
    low, high = (
        read(evidence, f"calibration.gas_line.ends.{i}.{key}", "m", digits=2) for i in (ends[0], ends[-1])
    )
    least, most = (line["ends"][i][key] for i in (ends[0], ends[-1]))
    names = [line["ends"][i].get("end") for i in (ends[0], ends[-1])]
    reached = low if len(ends) == 1 else f"{low} ({names[0]} valve) to {high} ({names[1]} valve)"
    return Requirement(
        name=name,
        wanted=f"at most {given(line[bound], 'm', digits=2)}",
        result=reached if most else "none",
        verdict=below((least, most), line[bound]),
        rests="" if line["given"] else "a default range of valves: the scene describes none",
        required=line[bound],
        reached=least,
        low=least,
        high=most,
        at_least=False,
    )


def _grade_row(evidence: Record) -> Requirement | None:
    wanted = (evidence.get("summary") or {}).get("requirement") or {}
    reached, bound = wanted.get("grade_at_residual_m_s"), wanted.get("grade_m_s")
    if reached is None:
        return None
    path = "summary.requirement.grade_at_residual_m_s"
    verdict = UNASKED
    if bound is not None:
        verdict = worst(below((reached,), bound), line_verdict(evidence), settles(evidence))
    return Requirement(
        name="Balance quality grade (ISO 21940-11) where the residual is met",
        wanted=_NONE if bound is None else f"at most G {number(1e3 * bound, digits=3)}",
        result=f"G {traced(number(1e3 * reached, digits=2), path)}",
        verdict=verdict,
        rests=resting(evidence, "rotor.mass", "rotor.influence_coefficient"),
        required=bound if verdict == below((reached,), bound or reached) else None,
        reached=reached,
        at_least=False,
    )
