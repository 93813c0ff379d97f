"""Tuning of a liquid ring's controller: its gain, margins, smallest correction, settling times and status."""

from __future__ import annotations

import math

import numpy as np

from ringbalance.controller.algorithms.by_name import controller_of, law_based_of
from ringbalance.controller.liquid_ring.loop_factor import (
    LoopFactor,
    Margins,
    loop_factor,
    loop_margins,
    vibration_rates,
    with_driving_gas,
)
from ringbalance.controller.liquid_ring.plant import BEYOND_CAPACITY, RUNS_BACK
from ringbalance.controller.terms import check_settings, run_models
from ringbalance.controller.tuning.dead_time import dead_times, dead_zone
from ringbalance.controller.tuning.recommendation import FactorUncertainty, factor_uncertainty
from ringbalance.controller.tuning.result import Tuning
from ringbalance.controller.tuning.search import (
    LIMITS,
    VALVES,
    Candidate,
    Search,
    recommended,
    search,
    with_ways_out,
)
from ringbalance.controller.tuning.settling import MEMBERS, RUNS, Progress, SettlingTimes, settling_times
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.gas_line import LineAnswer, largest_correction, line_answers
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene


def tune(
    scene: Scene,
    model: BalancerModel,
    *,
    members: int = MEMBERS,
    runs: int = RUNS,
    progress: Progress | None = None,
) -> Tuning:
    """Recommend a gain: the largest with which no residual turns round at the edge of the uncertainty.

    The law-based algorithm has no gain: its loop factor is one, whatever the flow, and the same margins and
    settling times are given for it.
    Raises: SceneError: settings without a meaning, or a rotor too slow to form a ring.
    """
    told = progress or (lambda _: None)
    check_settings(scene)
    check_ring(scene)
    told("uncertainty ...")
    known = factor_uncertainty(scene, model)
    best, found, settling = recommended(scene, model, known), None, None
    if best is not None:
        told("settling times ...")
        settling = settling_times(best.scene, model, known.widths, members=members, runs=runs, told=told)
        if settling.quantiles["p95"] is None and not (settling.out_of_capacity or settling.let_go):
            share = settling.settled.value
            found = search(scene, model, known, base=best, settled=share, told=told)
            if found.best is not best:
                best = found.best
                if best.scene.gas.pressure != scene.gas.pressure:
                    known = factor_uncertainty(best.scene, model)
                told("settling times ...")
                settling = settling_times(
                    best.scene, model, known.widths, members=members, runs=runs, told=told
                )
            if settling.quantiles["p95"] is None and not found.needs_more_than(scene.run.time_limit):
                found = with_ways_out(found, scene, model, known, members=members, runs=runs, told=told)
    return _judged(scene, model, known, best=best, found=found, settling=settling)


def _judged(
    scene: Scene,
    model: BalancerModel,
    known: FactorUncertainty,
    *,
    best: Candidate | None,
    found: Search | None,
    settling: SettlingTimes | None,
) -> Tuning:
    tuned, flows = scene if best is None else best.scene, best is not None
    settings = tuned.controller
    present = loop_factor(scene, model, controller_of(scene, model))
    loop = loop_factor(tuned, model, controller_of(tuned, model))
    smallest = float(np.max(vibration_rates(tuned, model))) * settings.minimum_gas_time
    dead = dead_times(tuned, model) if best is None else best.dead
    zone = dead_zone(tuned, model, dead)
    lines = line_answers(tuned, model)
    beyond = _beyond_capacity(scene, model)
    settles = settling is not None and settling.quantiles["p95"] is not None
    reaches = settles or _valves_reach(tuned, zone=zone, smallest=smallest)
    within = flows and loop.stays and reaches and beyond <= settings.limit
    # The law-based algorithm asks for the time in which the law moves the whole residual.
    gain = (1.0 / loop.rate if settings.kind == "law_based" else settings.proportional) if flows else None
    return Tuning(
        scene=tuned,
        law=model.name,
        gain=None if settings.kind == "law_based" else gain,
        present=present,
        loop=loop,
        margins=_margins(tuned, loop, known) if flows else None,
        contributions=known.parts,
        first_gas_time=None
        if gain is None
        else min(gain * scene.rotor.initial_amplitude, settings.maximum_gas_time),
        last_gas_time=None if gain is None else gain * settings.limit,
        smallest_correction=smallest,
        dead_times=dead,
        dead_zone=zone,
        change="" if best is None else best.change,
        search=found,
        beyond_capacity=beyond,
        reachable=within and _line_reaches(lines, settles=settles),
        gas_line=lines,
        settling=settling,
        models_used=run_models(scene=tuned, model=model),
        status=_over_capacity(scene, beyond)
        or _status_of(tuned, loop, zone=zone, smallest=smallest, settling=settling, best=best, found=found),
    )


def _beyond_capacity(scene: Scene, model: BalancerModel) -> float:
    """With gas that drives the liquid: what only a higher pressure can do is not beyond the disc."""
    ring = law_based_of(with_driving_gas(scene, model), model).ring
    return ring.unreachable_vibration(rotor=scene.rotor)


def _line_reaches(lines: tuple[LineAnswer, ...], *, settles: bool) -> bool | None:
    """Whether a given line can, which its runs show; of a default range: None when not all are sure to."""
    if not lines[0].holds:
        return settles
    above = [answer.above_limit for answer in lines]
    if not any(above):
        return True
    return settles if all(answer.end == "given" for answer in lines) else None


def _margins(scene: Scene, loop: LoopFactor, known: FactorUncertainty) -> Margins:
    settings = scene.controller
    error = abs(settings.assumed_lag_angle - scene.rotor.lag_angle)
    fixed = settings.kind != "law_based"
    return loop_margins(
        loop_factor=loop.value if fixed and loop.value else 1.0,
        gain_uncertainty=known.total,
        phase_uncertainty=known.widths.whole_lag_angle + error,
        integral=settings.period / (settings.integral_time or math.inf) if fixed else 0.0,
        derivative=settings.derivative_time / settings.period if fixed else 0.0,
    )


def _over_capacity(scene: Scene, beyond: float) -> str:
    """Empty within capacity."""
    limit, start, um = scene.controller.limit, scene.rotor.initial_amplitude, 1e6
    if beyond <= limit:
        return ""
    return (
        f"capacity exceeded: with the liquid at its best {beyond * um:.4g} um remain of {start * um:.4g} um, "
        f"limit {limit * um:.4g} um: {BEYOND_CAPACITY}"
    )


def _valves_reach(scene: Scene, *, zone: float, smallest: float) -> bool:
    """Whether valve-open times of these effects, m, leave the limit sure to be reached."""
    limit = scene.controller.limit
    return zone <= limit and smallest <= largest_correction(limit, chambers=scene.disc.chambers)


def _status_of(
    scene: Scene,
    loop: LoopFactor,
    *,
    zone: float,
    smallest: float,
    settling: SettlingTimes | None,
    best: Candidate | None,
    found: Search | None,
) -> str:
    """Of a scene as recommended, whose nominal unbalance is within the disc's capacity; lengths in m."""
    limit, um = scene.controller.limit, 1e6
    if loop.rate == 0.0:
        return "no gain: the gas drives no liquid at the balanced fills: raise gas.pressure"
    if best is None or settling is None or not loop.stays:
        return (
            f"no gain keeps the amplitude within {limit * um:.4g} um: the sensor's noise is "
            f"{scene.sensor.amplitude_noise * um:.4g} um: raise controller.limit or average the sensor"
        )
    also = f", with {best.change}" if best.change else ""
    reached = settling.quantiles["p95"]
    if reached is not None:
        return f"tuned{also}: 95 % of the runs settle within {reached:.3g} s"
    share = (
        f"{settling.told(settling.settled.value)} settle within the time limit of "
        f"{scene.run.time_limit:.4g} s{also}: 95 % is not reached"
    )
    if settling.let_go:
        return f"{share}; {settling.let_go.text}"
    if not _valves_reach(scene, zone=zone, smallest=smallest) and not settling.out_of_capacity:
        return (
            f"the valve is too slow for the limit of {limit * um:.4g} um: the shortest valve-open time moves "
            f"the vibration by {smallest * um:.4g} um, and up to {zone * um:.4g} um none transfers liquid: "
            f"{_ways_out(found)}"
        )
    return _unsettled(scene, settling, share=share, found=found)


def _unsettled(scene: Scene, settling: SettlingTimes, *, share: str, found: Search | None) -> str:
    """Of runs that settle too seldom, by what explains them. Args: `share`: of them that settle, in words."""
    if settling.explained_by(settling.beyond_capacity):
        return (
            f"{share}; {settling.told(settling.beyond_capacity)} would need more moment than the disc "
            f"can form above its residual fill: {BEYOND_CAPACITY}"
        )
    if found is not None and found.needs is not None and found.needs_more_than(scene.run.time_limit):
        return f"{share}; they need some {found.needs:.2g} s: raise run.time_limit"
    if settling.explained_by(settling.beyond_pressure):
        return (
            f"{share}, nor by other gains; in {settling.told(settling.beyond_pressure)} the gas does not "
            f"drive the liquid far enough at {scene.gas.pressure / 1e6:.3g} MPa: raise gas.pressure"
        )
    if settling.explained_by(settling.drifted):
        return (
            f"{share}, nor by other gains and pressures; in {settling.told(settling.drifted)} the full tube "
            f"lets liquid run back while the gas is off: {RUNS_BACK}"
        )
    others = "" if found is None or found.settles else ", nor by other gains and pressures"
    return f"{share}{others}: {_ways_out(found)}"


def _ways_out(found: Search | None) -> str:
    """What lets 95 % of as many runs settle."""
    if found is None:
        return "raise controller.limit"
    ways = [
        text.format(value)
        for value, text in (
            (found.opening and 1e3 * found.opening, "lower controller.minimum_gas_time to {:.3g} ms"),
            (found.limit and 1e6 * found.limit, "raise controller.limit to {:.3g} um"),
            (found.valve, "take a valve and line {:.3g} times as fast"),
        )
        if value is not None
    ]
    if ways:
        return ", or ".join(ways)
    return (
        f"neither a limit {LIMITS[-1]:.3g} times as high nor a valve and line {VALVES[-1]:.3g} times as fast "
        "would do: state less uncertainty under [uncertainty] when the machine is known better"
    )
