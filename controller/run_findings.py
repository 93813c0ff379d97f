"""What a finished run says: how it ended, with its numbers, and what to do next, as findings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from ringbalance.controller.liquid_ring.reach import LEAST_PRESSURE, NEARLY_EMPTY, starting_pressure
from ringbalance.controller.outcome import Facts, longest, unusable
from ringbalance.controller.simulation import NOISE_DEVIATIONS, Injection, Outcome
from ringbalance.controller.tuning.dead_time import standing_finding
from ringbalance.controller.tuning.loop_factor import STAYING_DEVIATIONS
from ringbalance.controller.tuning.recommendation import recommended_gain
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.results.rows import Finding, Value, sentences

MANY_OVERSHOOTS: Final = 2


def run_findings(facts: Facts) -> tuple[Finding, ...]:
    """The first says how the run ended, the others what stands behind it and what to change."""
    outcome = facts.outcome
    code = "stalled_at_start" if outcome is Outcome.STALLED and _still(facts) is not None else outcome.value
    if outcome is Outcome.GAS_TIME_TOO_SHORT and facts.last_command and not longest(facts).operation.moved:
        code = "injection_too_short"
    numbers = _numbers(facts)
    ended = Finding(code=code, values={name: numbers[name] for name in sentences()[code].values})
    return (ended, *_causes(facts), *_shortened(facts))


def _numbers(facts: Facts) -> dict[str, Value]:
    """Of which a sentence takes what it names."""
    settings, run = facts.scene.controller, facts.scene.run
    numbers: dict[str, Value] = {
        "initial_amplitude": facts.initial_amplitude,
        "final_amplitude": facts.final_amplitude,
        "limit": settings.limit,
        "time": facts.time,
        "time_limit": run.time_limit,
        "hold_time": settings.hold_time,
        "settling_time": facts.settling_time,
        "since": facts.since,
        "loop_factor": facts.loop.value,
        "loop_factor_limit": facts.loop.limit,
        "minimum_gas_time": settings.minimum_gas_time,
        "noise": facts.scene.sensor.amplitude_noise,
        "deviations": NOISE_DEVIATIONS,
        "samples": len(facts.samples),
        "unusable": unusable(facts),
    }
    if facts.last_command:
        last = longest(facts)
        numbers |= {"duration": last.operation.duration, "chamber": last.chamber}
    if facts.outcome is Outcome.STALLED:
        numbers |= _pressures(facts, _still(facts))
    if facts.outcome is Outcome.CAPACITY_EXCEEDED:
        numbers |= _moments(facts)
    if facts.outcome is Outcome.CHAMBER_EMPTY and facts.refused:
        numbers |= {"chamber": facts.refused[0]}
    return numbers


def _causes(facts: Facts) -> Iterator[Finding]:
    outcome, turned = facts.outcome, facts.overshoots
    if outcome is Outcome.HOVERING:
        yield from _noise(facts)
    if outcome in {Outcome.HOVERING, Outcome.UNSTABLE} or (
        outcome in {Outcome.SETTLED, Outcome.TIME_LIMIT, Outcome.DIVERGING} and turned > _allowed(outcome)
    ):
        yield from _smaller_steps(facts)
    elif outcome is Outcome.TIME_LIMIT:
        yield from _dead_time(facts) or [_larger_gain(facts, "slow")]
    if outcome is Outcome.DIVERGING:
        yield Finding(code="check_direction")
    if outcome is Outcome.STALLED and facts.unreachable_amplitude > facts.scene.controller.limit:
        yield Finding(code="unbalance_beyond_gas", values=_moments(facts))
    if outcome is Outcome.DRIFTING:
        total = 2 * facts.scene.disc.initial_fill
        fill = total - min(facts.plant.residual_fill, total / 2)
        yield Holding.of(facts.scene, fill_ratio=fill).finding or Finding(code="tube_runs_back")
    if outcome is Outcome.GAS_TIME_TOO_SHORT:
        moved = not facts.last_command or longest(facts).operation.moved
        yield from [_larger_gain(facts, "valve_minimum")] if moved else _dead_time(facts) or [_pushed(facts)]


def _allowed(outcome: Outcome) -> int:
    """Overshoots that need no remedy."""
    return 1 if outcome is Outcome.DIVERGING else MANY_OVERSHOOTS


def _noise(facts: Facts) -> Iterator[Finding]:
    sigma, deviation = facts.scene.sensor.amplitude_noise, facts.loop.deviation
    if NOISE_DEVIATIONS * sigma > facts.scene.controller.limit:
        yield Finding(code="sensor_noise_too_high", values={"noise": sigma})
    elif deviation is not None and math.isfinite(deviation):
        yield Finding(
            code="noise_sustained", values={"deviation": deviation, "deviations": STAYING_DEVIATIONS}
        )


def _smaller_steps(facts: Facts) -> Iterator[Finding]:
    """What to change in a loop that overshoots; the law-based algorithm has no gain to lower."""
    settings = facts.scene.controller
    turns: dict[str, Value] = {"overshoots": facts.overshoots}
    if facts.own_algorithm:
        yield Finding(code="own_gain_too_high", values={**turns, "algorithm": facts.own_algorithm})
    elif settings.kind == "law_based":
        yield from _dead_time(facts) or [Finding(code="assumed_influence_wrong", values=turns)]
    elif settings.kind == "trial":
        yield Finding(code="trial_steps_too_long", values=turns)
    else:
        gain = recommended_gain(facts.scene, facts.plant.model, loop=facts.loop)
        if facts.loop.value is None or not 0 < gain < settings.proportional:
            yield Finding(code="gain_too_high", values=turns)
        else:
            change = {"controller.proportional": gain}
            yield Finding(code="gain_too_high_by", values={**turns, "gain": gain}, change=change)


def _larger_gain(facts: Facts, code: str) -> Finding:
    """Args: `code`: "slow" or "valve_minimum"."""
    numbers: dict[str, Value] = {"minimum_gas_time": facts.scene.controller.minimum_gas_time}
    if facts.own_algorithm:
        return Finding(code=f"own_{code}", values={**numbers, "algorithm": facts.own_algorithm})
    return Finding(code=code, values=numbers)


def _dead_time(facts: Facts) -> list[Finding]:
    found = None if facts.own_algorithm else standing_finding(facts.scene, facts.plant.model)
    return [] if found is None else [found]


def _pushed(facts: Facts) -> Finding:
    """What moves liquid where an amplitude stands still."""
    settings = facts.scene.controller
    from_scene = settings.kind == "target_vector" and not facts.own_algorithm
    return Finding(
        code="integral_missing" if from_scene and settings.integral_time is None else "valve_too_slow"
    )


def _shortened(facts: Facts) -> Iterator[Finding]:
    if facts.shortened:
        numbers: dict[str, Value] = {"count": facts.shortened, "residual_fill": facts.plant.residual_fill}
        yield Finding(code="injections_shortened", values=numbers)


def _moments(facts: Facts) -> dict[str, Value]:
    """The unbalance, the usable moment of a pair under the scene's gas, and what is left at best."""
    return {
        "unbalance": abs(facts.scene.rotor.initial_unbalance),
        "pair_moment": abs(facts.plant.largest_pair_moment(state=facts.state)),
        "unreachable": facts.plant.unreachable_vibration(state=facts.state, rotor=facts.scene.rotor),
    }


def _still(facts: Facts) -> Injection | None:
    """The last injection, where it moved nothing."""
    last = longest(facts) if facts.last_command else None
    return None if last is None or last.operation.moved else last


def _pressures(facts: Facts, still: Injection | None) -> dict[str, Value]:
    """Where the gas drives no liquid, and the pressures that would; None: its liquid has left the port."""
    plant, total = facts.plant, facts.state.pairs[0].total
    lowest = max(0.0, total - plant.model.flow.max_fill_ratio)
    numbers: dict[str, Value] = {
        "gas_pressure": plant.gas_pressure,
        "fill": plant.least_fill(state=facts.state),
        "pressure_to_empty": _needed(facts, total, lowest + NEARLY_EMPTY),
    }
    if still is None:
        return numbers
    fill = still.operation.fill_after
    numbers |= {"fill": fill, "chamber": still.chamber, "pressure_to_start": _needed(facts, total, fill)}
    return numbers


def _needed(facts: Facts, total: float, fill: float) -> float | None:
    """The pressure, Pa, from which an injection begins at a fill, over an empty crest: short ones all do."""
    law = facts.plant.model.flow
    return starting_pressure(
        law=law,
        fill=fill,
        opposite_fill=min(total - fill, law.max_fill_ratio),
        primed=False,
        above=max(facts.plant.gas_pressure, LEAST_PRESSURE),
    )
