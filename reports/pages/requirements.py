"""What the device must do, what it does, and whether that can be told: one row a requirement."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from ringbalance.controller.tuning.loop_factor import STAYING_DEVIATIONS
from ringbalance.reports.figures.operation import requirement_bars
from ringbalance.reports.figures.style import Drawing
from ringbalance.reports.numbers import given, number, percent, shown
from ringbalance.reports.prose import key_words
from ringbalance.reports.section import Record, Table
from ringbalance.reports.traces import evidence_at, read, traced, untraced
from ringbalance.scene import Scene

MET: Final = "met"
MISSED: Final = "not met"
OPEN: Final = "cannot be told"
UNASKED: Final = "none stated"
_NONE: Final = "the scene asks for none"
_CERTAIN: Final = ("given", "measured")
_LIKELY: Final = 0.95
"""Fraction of runs that must settle in time, the confidence of every interval in the report."""


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
    """As a number of `unit`; None where there is none to draw."""
    reached: float | None = None
    uncertainty: float = 0.0
    low: float | None = None
    high: float | None = None
    """Ends of what is reached, where they are others than plus and minus the uncertainty."""
    unit: str = "1"
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
    return [row for make in (*every, _smallest, _standing, _grade_row) if (row := make(evidence)) is not None]


def requirement_table(rows: Iterable[Requirement]) -> Table:
    """As printed."""
    return Table(
        caption="Requirements. A result within its uncertainty of what is required cannot be told; what "
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


def decision(rows: Iterable[Requirement]) -> str:
    """One sentence: how many requirements are met, and which are not."""
    judged = [row for row in rows if row.verdict in {MET, MISSED, OPEN}]
    named = {v: [r.name.lower() for r in judged if r.verdict == v] for v in (MISSED, OPEN)}
    said = f"{len(judged) - sum(map(len, named.values()))} of {len(judged)} requirements are met"
    parts = [f"{verdict}: {', '.join(names)}" for verdict, names in named.items() if names]
    return "; ".join([said, *parts]) + "."


def resting(evidence: Record, *paths: str) -> str:
    """The inputs among some that are neither given nor measured, with their origin."""
    origins = evidence["scene"].get("origins") or {}
    by_origin: dict[str, list[str]] = {}
    for path in paths:
        if (origin := origins.get(path, "given")) not in _CERTAIN:
            by_origin.setdefault(origin, []).append(key_words(path))
    return "; ".join(f"{origin}: {', '.join(names)}" for origin, names in by_origin.items())


def named_with_origin(evidence: Record, path: str) -> str:
    """An input's name, with its origin where it is neither given nor measured."""
    origin = (evidence["scene"].get("origins") or {}).get(path, "given")
    return input_name(path) + ("" if origin in _CERTAIN else f" ({origin})")


def input_name(path: str) -> str:
    """The name of an input that a path in the scene file stands for, such as "bore of the tube"."""
    table, _, key = path.partition(".")
    return f"{key_words(path)} of the {table.replace('_', ' ')}" if key else path


def _capacity(evidence: Record) -> Requirement | None:
    rest, own = evidence["calibration"].get("residual_liquid"), evidence.get("summary")
    if not rest or not own:
        return None
    stated = (own.get("requirement") or {}).get("correction_moment_kg_m") is not None
    path = "summary.requirement.correction_moment_kg_m" if stated else "summary.needed_moment_kg_m"
    width = 0.0 if stated else own.get("needed_uncertainty_kg_m") or 0.0
    usable = "calibration.residual_liquid.usable_pair_moment_kg_m"
    total, needed = _usable_width(evidence), evidence_at(evidence, path)
    both = math.hypot(total, width)
    return Requirement(
        name="Correction capacity of one pair",
        wanted=f"at least {read(evidence, path, 'kg m', width=width)}",
        result=read(evidence, usable, "kg m", width=total),
        verdict=_above(rest["usable_pair_moment_kg_m"], needed, both),
        rests=resting(evidence, "rotor.influence_coefficient", "disc.plate_thickness", "tube.bore"),
        required=needed,
        reached=rest["usable_pair_moment_kg_m"],
        uncertainty=both,
        unit="kg m",
    )


def _usable_width(evidence: Record) -> float:
    calibration = evidence["calibration"]
    budget = (calibration.get("budgets") or {}).get("usable_moment")
    return float(
        budget["total"] if budget else calibration["residual_liquid"]["usable_pair_moment_uncertainty"]
    )


def _above(value: float, bound: float, width: float) -> str:
    if abs(value - bound) <= width:
        return OPEN
    return MET if value > bound else MISSED


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
    verdicts = {_above(gas, bound, both) for bound in (least, most)}
    return Requirement(
        name="Gas pressure " + ("that lifts the liquid over the siphon crest" if starts else "above stall"),
        wanted=f"at least {read(evidence, f'operating_point.{key}', 'Pa', width=width)}{anywhere}",
        result=read(evidence, "operating_point.gas_pressure_Pa", "Pa", width=own),
        verdict=verdicts.pop() if len(verdicts) == 1 else OPEN,
        rests=resting(evidence, "tube.hump_radius", "tube.port_radius", "tube.hump_gas"),
        required=point[key],
        reached=gas,
        uncertainty=both,
        low=gas * point[key] / most - both if most > 0 else None,
        high=gas * point[key] / least + both if least > 0 else None,
        unit="Pa",
    )


def _scene_gain(evidence: Record) -> Requirement | None:
    run = evidence["closed_loop"].get("calibrated")
    if run is None or run.get("loop_factor") is None:
        return None
    limit = _staying(run, "closed_loop.calibrated")
    bound = traced(number(run["loop_factor_limit"], digits=3), "closed_loop.calibrated.loop_factor_limit")
    return Requirement(
        name="Loop factor with the scene’s gain",
        wanted=f"at most {limit} for noise to stay within the limit; unstable from {bound}",
        result=read(evidence, "closed_loop.calibrated.loop_factor", "1"),
        verdict=MET if run["loop_factor"] <= _staying_value(run) else MISSED,
        rests=resting(evidence, "tube.bore", "rotor.influence_coefficient", "sensor.amplitude_noise"),
        required=_staying_value(run),
        reached=run["loop_factor"],
        at_least=False,
    )


def _staying_value(run: Record) -> float:
    return float(run.get("largest_staying_loop_factor") or run["loop_factor_limit"])


def _staying(run: Record, path: str) -> str:
    key = "largest_staying_loop_factor" if run.get("largest_staying_loop_factor") else "loop_factor_limit"
    return traced(number(run[key], digits=3), f"{path}.{key}")


def _tuning(evidence: Record) -> Record:
    return (evidence.get("summary") or {}).get("tuning") or {}


def _recommended_gain(evidence: Record) -> Requirement | None:
    tuning, run = _tuning(evidence), evidence["closed_loop"].get("calibrated")
    if tuning.get("gain") is None or run is None or tuning.get("loop_factor") is None:
        return None
    width = tuning["loop_factor"] * (tuning.get("margins") or {}).get("gain_uncertainty", 0.0)
    gain = read(evidence, "summary.tuning.gain", "s/m", digits=2)
    bound = run["loop_factor_limit"]
    return Requirement(
        name=f"Loop factor with the recommended gain of {gain}",
        wanted=f"less than {traced(number(bound, digits=3), 'closed_loop.calibrated.loop_factor_limit')}",
        result=read(evidence, "summary.tuning.loop_factor", "1", width=width),
        verdict=_above(bound, tuning["loop_factor"], width),
        rests=resting(evidence, "tube.bore", "rotor.influence_coefficient"),
        required=bound,
        reached=tuning["loop_factor"],
        uncertainty=width,
        at_least=False,
    )


def _settling(evidence: Record) -> Requirement | None:
    tuning = _tuning(evidence)
    times = tuning.get("settling_time_s") or {}
    if times.get("p95") is None:
        return None
    wanted = (evidence["summary"].get("requirement") or {}).get("settling_time_s")
    low, high = tuning["fraction_settled_95"]
    late, certain = wanted is not None and times["p95"] > wanted, low >= _LIKELY
    judged = MISSED if late or high < _LIKELY else (MET if certain else OPEN)
    middle = read(evidence, "summary.tuning.settling_time_s.p50", "s", digits=2)
    slow = read(evidence, "summary.tuning.settling_time_s.p95", "s", digits=2)
    return Requirement(
        name="Settling time with the recommended gain",
        wanted=_NONE if wanted is None else f"at most {given(wanted, 's')} in {percent(_LIKELY)} of runs",
        result=f"median {middle}, {percent(_LIKELY)} of runs within {slow}; settled: "
        f"{traced(percent(tuning['fraction_settled']), 'summary.tuning.fraction_settled')} of "
        f"{tuning['runs']} runs, with 95 % confidence {percent(low)} to {percent(high)}"
        f"{_ideal_valve(evidence)}",
        verdict=UNASKED if wanted is None else judged,
        rests=resting(evidence, "tube.bore", "rotor.influence_coefficient", "controller.period"),
        required=wanted,
        reached=times["p95"],
        unit="s",
        at_least=False,
    )


def _residual_row(evidence: Record) -> Requirement | None:
    tuning, run = _tuning(evidence), evidence["closed_loop"].get("calibrated") or {}
    path = "summary.tuning.stationary_deviation_m" if tuning.get("stationary_deviation_m") else ""
    if not path and run.get("stationary_deviation_m"):
        path = "closed_loop.calibrated.stationary_deviation_m"
    wanted = (evidence.get("summary") or {}).get("requirement") or {}
    if not path or wanted.get("residual_m") is None:
        return None
    noise, limit = STAYING_DEVIATIONS * evidence_at(evidence, path), wanted["residual_m"]
    moment = read(evidence, "summary.requirement.residual_moment_kg_m", "kg m", digits=2)
    gain = "the recommended gain" if tuning.get("stationary_deviation_m") else "the scene’s gain"
    return Requirement(
        name="Residual vibration, zero to peak",
        wanted=f"at most {given(limit, 'm')}, an unbalance of {moment}",
        result=f"{shown(noise, 'm', digits=2)}: {STAYING_DEVIATIONS:g} standard deviations of what noise "
        f"keeps up with {gain}{_ideal_valve(evidence)}",
        verdict=MET if noise <= limit else MISSED,
        rests=resting(evidence, "sensor.amplitude_noise", "rotor.influence_coefficient"),
        required=limit,
        reached=noise,
        unit="m",
        at_least=False,
    )


def _ideal_valve(evidence: Record) -> str:
    line = evidence["calibration"].get("gas_line") or {"given": True}
    return "" if line["given"] else "; for a valve that acts at once"


def _smallest(evidence: Record) -> Requirement | None:
    return _of_line(evidence, "smallest_correction_m", "Smallest correction that the valve can give")


def _standing(evidence: Record) -> Requirement | None:
    """With the scene's own gain and offsets, by the dead time in which gas only fills a chamber."""
    name = "Vibration up to which the scene’s valve-open times only fill gas"
    return _of_line(evidence, "standing_amplitude_m", name)


def _of_line(evidence: Record, key: str, name: str) -> Requirement | None:
    line = evidence["calibration"].get("gas_line")
    if not line or any(end.get(key) is None for end in line["ends"]):
        return None
    ends = sorted(range(len(line["ends"])), key=lambda i: line["ends"][i][key])
    low, high = (
        read(evidence, f"calibration.gas_line.ends.{i}.{key}", "m", digits=2) for i in (ends[0], ends[-1])
    )
    above = [end[key] > line["limit_m"] for end in line["ends"]]
    return Requirement(
        name=name,
        wanted=f"at most {given(line['limit_m'], 'm')}",
        result=low if low == high else f"{low} (fast valve) to {high} (slow valve)",
        verdict=MISSED if all(above) else (OPEN if any(above) else MET),
        rests="" if line["given"] else "a default range of valves: the scene describes none",
    )


def _grade_row(evidence: Record) -> Requirement | None:
    wanted = (evidence.get("summary") or {}).get("requirement") or {}
    reached, bound = wanted.get("grade_at_residual_m_s"), wanted.get("grade_m_s")
    if reached is None:
        return None
    path = "summary.requirement.grade_at_residual_m_s"
    return Requirement(
        name="Balance quality grade at the residual, ISO 21940-11",
        wanted=_NONE if bound is None else f"at most G {number(1e3 * bound, digits=3)}",
        result=f"G {traced(number(1e3 * reached, digits=2), path)}, in mm/s",
        verdict=UNASKED if bound is None else (MET if reached <= bound else MISSED),
        rests=resting(evidence, "rotor.mass", "rotor.influence_coefficient"),
        required=bound,
        reached=reached,
        unit="m/s",
        at_least=False,
    )
