"""Findings on a finished run: its numbers and what to do next."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from ringbalance.controller.balancer import WATCH_TIME_S
from ringbalance.controller.liquid_ring.loop_factor import default_gain, short_period, small_margin
from ringbalance.controller.liquid_ring.plant import (
    LEAST_PRESSURE_PA,
    NEARLY_EMPTY,
    starting_pressure,
)
from ringbalance.controller.loop_records import NOTICEABLE_CHANGE
from ringbalance.controller.rotor import assumed_rotor
from ringbalance.controller.simulation import NOISE_DEVIATIONS, Outcome, Simulation
from ringbalance.controller.terms import dead_time
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.results.rows import Finding, Value, sentences

_BY_SETTINGS: Final = {
    *(Outcome.HOVERING, Outcome.UNSTABLE, Outcome.TIME_LIMIT, Outcome.LIMIT_CYCLE),
    *(Outcome.DIVERGING, Outcome.GAS_TIME_TOO_SHORT),
}
"""Ends that other settings may change."""


def run_findings(run: Simulation) -> tuple[Finding, ...]:
    """Findings on a run: first on its end, then on causes and what to change."""
    code = run.outcome.value
    if not _moves(run):
        unmoved = {Outcome.STALLED: "stalled_at_start", Outcome.GAS_TIME_TOO_SHORT: "injection_too_short"}
        code = unmoved.get(run.outcome, code)
    numbers = _numbers(run)
    findings = [Finding(code=code, values={name: numbers[name] for name in sentences()[code].values})]

    scene, time = run.scene, run.settling_time
    required, allowed = scene.requirement.settling_time, scene.required_amplitude
    if time is not None and required is not None and time > required:
        values: dict[str, Value] = {"settling_time": time, "required": required}
        findings.append(Finding(code="settled_too_late", values=values))
    if allowed is not None and scene.controller.limit > allowed:
        values = {"limit": scene.controller.limit, "allowed": allowed}
        findings.append(Finding(code="limit_above_requirement", values=values))
    findings += _runout(run)
    findings += _causes(run)
    if count := run.shortened:
        values = {"count": count, "residual_fill": run.plant.residual_fill}
        findings.append(Finding(code="injections_shortened", values=values))
    findings += assumed_rotor(scene)
    if run.loop.fixed:
        findings += default_gain(scene)
    return tuple(findings)


def _runout(run: Simulation) -> Iterator[Finding]:
    """Findings on the vibration of the rotor where the sensor shows more than that."""
    sensor, final, allowed = run.scene.sensor, float(run.amplitude[-1]), run.scene.required_amplitude
    if sensor.runout_amplitude is None:
        return
    values: dict[str, Value] = {"runout": sensor.runout_amplitude, "reading": float(run.reading[-1])}
    yield Finding(code="runout", values={**values, "final_amplitude": final})
    if sensor.runout_phase is None:
        yield Finding(code="runout_phase_open")
    if allowed is not None and final > allowed and run.settled:
        yield Finding(code="rotor_above_requirement", values={"final_amplitude": final, "allowed": allowed})


def _moves(run: Simulation) -> bool:
    """True if the longest injection of the last command has moved liquid, or there was none."""
    return run.longest is None or run.longest.moved


def _numbers(run: Simulation) -> dict[str, Value]:
    """Numbers by the names that the sentences use."""
    settings = run.scene.controller
    numbers: dict[str, Value] = {
        "initial_amplitude": float(run.reading[0]),
        "final_amplitude": float(run.reading[-1]),
        "limit": settings.limit,
        "time": float(run.state["time"]),
        "time_limit": run.scene.run.time_limit,
        "hold_time": settings.hold_time,
        "further": WATCH_TIME_S,
        "lost": int(run.state["lost"]),
        "settling_time": run.settling_time,
        "since": float(run.state["since"]),
        "loop_factor": run.loop.value,
        "loop_factor_limit": run.loop.limit,
        "minimum_gas_time": settings.minimum_gas_time,
        "noise": run.scene.sensor.amplitude_noise,
        "deviations": NOISE_DEVIATIONS,
        "samples": len(run.samples),
        "unusable": run.unusable,
    }
    if run.longest is not None:
        numbers |= {"duration": run.longest.duration, "chamber": run.longest.chamber}
    if run.outcome is Outcome.LIMIT_CYCLE and run.limit_cycle:
        numbers["corrections"], numbers["cycle_amplitude"] = run.limit_cycle
    if run.outcome is Outcome.STALLED:
        numbers |= _pressures(run)
    if run.outcome is Outcome.CAPACITY_EXCEEDED:
        numbers |= _moments(run)
    if run.outcome is Outcome.CHAMBER_EMPTY and run.refused:
        numbers |= {"chamber": run.refused[0]}
    return numbers


def _causes(run: Simulation) -> Iterator[Finding]:
    """Causes that a formula or a count explains; runs of drawn devices show what to change."""
    outcome, scene, loop = run.outcome, run.scene, run.loop
    if outcome is Outcome.HOVERING:
        sigma, deviation = scene.sensor.amplitude_noise, loop.deviation
        if NOISE_DEVIATIONS * sigma > scene.controller.limit:
            yield Finding(code="sensor_noise_too_high", values={"noise": sigma})
        elif deviation is not None and math.isfinite(deviation):
            yield Finding(code="noise_sustained", values={"deviation": deviation})
    if outcome in {Outcome.TIME_LIMIT, Outcome.GAS_TIME_TOO_SHORT}:
        yield from _dead_time(run)
    near_instability = tuple(small_margin(scene, loop.margins)) if loop.fixed else ()
    if outcome is Outcome.LIMIT_CYCLE and run.controller == "target_vector" and not near_instability:
        yield Finding(code="cycle_ends")
    if outcome in {Outcome.DIVERGING, Outcome.UNSTABLE} and not near_instability:
        # A residual grows by nothing that the loop knows.
        yield Finding(code="check_direction")
    yield from near_instability
    if outcome is Outcome.STALLED and run.unreachable_amplitude > scene.controller.limit:
        yield Finding(code="unbalance_beyond_gas", values=_moments(run))
    ran_back = run.state["drift"] > NOTICEABLE_CHANGE and not run.settled
    short = tuple(short_period(scene, run.plant.model)) if ran_back else ()
    if outcome is Outcome.DRIFTING:
        total = 2 * scene.disc.initial_fill
        fill = total - min(run.plant.residual_fill, total / 2)
        held = Holding.of(scene, fill_ratio=fill)
        lost = None if held.likely_speed is not None else held.finding
        if lost or not short:
            yield lost or Finding(code="tube_runs_back")
    yield from short
    if outcome in _BY_SETTINGS:
        foreign = run.controller != scene.controller.kind
        code = "own_overshoots" if foreign else "overshoots"
        yield Finding(code=code, values={"overshoots": run.overshoots})


def _dead_time(run: Simulation) -> list[Finding]:
    """Finding that the amplitude stays above the limit, since its valve-open time moves no liquid."""
    scene, loop = run.scene, run.loop
    foreign = run.controller != scene.controller.kind
    if foreign or scene.controller.kind == "trial" or loop.rate == 0.0:
        return []
    lost = dead_time(scene, run.plant.model, rate=loop.rate)
    rest = max(lost - min(scene.controller.offsets(scene.disc.chambers)), 0.0)
    per_time = loop.rate if scene.controller.kind == "law_based" else 1.0 / scene.controller.proportional
    if rest * per_time <= scene.controller.limit:
        return []
    return [Finding(code="dead_time", values={"standing_amplitude": rest * per_time, "dead_time": lost})]


def _moments(run: Simulation) -> dict[str, Value]:
    """Unbalance, usable moment of a pair under the scene's gas, and vibration left at best."""
    return {
        "unbalance": abs(run.scene.rotor_as_read.initial_unbalance),
        "pair_moment": abs(run.plant.largest_pair_moment()),
        "unreachable": run.unreachable_amplitude,
    }


def _pressures(run: Simulation) -> dict[str, Value]:
    """Fill at which the gas drives no liquid, and pressures that would, Pa; None: none does."""
    plant, still = run.plant, None if _moves(run) else run.longest
    law, total = plant.model.flow, plant.total

    def pressure_from(fill: float) -> float | None:
        """Least pressure that starts an injection over an empty crest, as with all short ones, Pa."""
        return starting_pressure(
            law=law,
            fill=fill,
            opposite_fill=min(total - fill, law.max_fill_ratio),
            above=max(plant.gas_pressure, LEAST_PRESSURE_PA),
        )

    lowest = max(0.0, total - law.max_fill_ratio)
    numbers: dict[str, Value] = {
        "gas_pressure": plant.gas_pressure,
        "fill": plant.least_fill,
        "pressure_to_empty": pressure_from(lowest + NEARLY_EMPTY),
    }
    if still is not None:
        fill = still.fill_after
        numbers |= {"fill": fill, "chamber": still.chamber, "pressure_to_start": pressure_from(fill)}
    return numbers
