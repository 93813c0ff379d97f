"""Tuning of a liquid ring's controller: its gain, margins, smallest correction and settling times."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ringbalance.controller.algorithms.by_name import controller_of, law_based_of
from ringbalance.controller.checks import check_settings
from ringbalance.controller.liquid_ring.plant import DiscState
from ringbalance.controller.terms import run_models
from ringbalance.controller.tuning.dead_time import dead_times, dead_zone
from ringbalance.controller.tuning.loop_factor import (
    LoopFactor,
    loop_factor,
    vibration_rates,
    with_driving_gas,
)
from ringbalance.controller.tuning.margins import Margins, loop_margins
from ringbalance.controller.tuning.recommendation import Contribution, FactorUncertainty, factor_uncertainty
from ringbalance.controller.tuning.search import Candidate, Search, recommended, search, with_ways_out
from ringbalance.controller.tuning.settling import MEMBERS, RUNS, Progress, SettlingTimes, settling_times
from ringbalance.controller.tuning.status import over_capacity, status_of, valves_reach
from ringbalance.reduced_model.chamber.gravity import check_ring
from ringbalance.reduced_model.gas_line import LineAnswer, line_answers, line_document
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.selection.registry import ModelUsed, neglected_in_injections
from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """What is recommended for a scene's controller under a law."""

    scene: Scene
    """With what is recommended."""
    law: str
    gain: float | None
    """Kc, s/m; None for an algorithm without a gain, and where no gain reaches the limit."""
    present: LoopFactor
    """With the scene's own gain."""
    loop: LoopFactor
    """With the recommended one."""
    margins: Margins | None
    contributions: tuple[Contribution, ...]
    first_gas_time: float | None
    """s, of the vector, for the initial vibration."""
    last_gas_time: float | None
    """s, for an amplitude at the limit."""
    smallest_correction: float
    """Change of the vibration by the shortest valve-open time in the fastest chamber, m."""
    dead_times: tuple[float, ...]
    """s, of every chamber; empty where runs do not model the filling of gas."""
    dead_zone: float
    """Largest amplitude at which no valve may open any more, or none transfers liquid, m."""
    change: str
    """Keys and values that are recommended beside the gain; empty: none."""
    search: Search | None
    """What was tried because the runs under the first recommendation do not settle; None: they do."""
    beyond_capacity: float
    """Vibration that remains with the liquid at its best, m."""
    reachable: bool | None
    """Whether valves and gas line can bring the amplitude below the limit; None: the line is not known."""
    gas_line: tuple[LineAnswer, ...]
    """What the gas line can deliver, or both ends of a default range of lines."""
    settling: SettlingTimes | None
    models_used: tuple[ModelUsed, ...]
    status: str

    @property
    def succeeded(self) -> bool:
        """Whether 95 % of the runs settle in time, and nothing that is known stands against it."""
        reached = self.settling is not None and self.settling.quantiles["p95"] is not None
        return reached and self.reachable is not False


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
    told = progress or _silent
    check_settings(scene)
    check_ring(scene)
    told("uncertainty ...")
    known = factor_uncertainty(scene, model)
    best, found, settling = recommended(scene, model, known), None, None
    if best is not None:
        told("settling times ...")
        settling = settling_times(best.scene, model, known.widths, members=members, runs=runs, told=told)
        if settling.quantiles["p95"] is None and not settling.out_of_capacity:
            share = settling.settled.value
            found = search(scene, model, known, base=best, settled=share, told=told)
            if found.best is not best:
                best = found.best
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
    reaches = settles or valves_reach(tuned, zone=zone, smallest=smallest)
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
        status=over_capacity(scene, beyond)
        or status_of(tuned, loop, zone=zone, smallest=smallest, settling=settling, best=best, found=found),
    )


def _beyond_capacity(scene: Scene, model: BalancerModel) -> float:
    """With gas that drives the liquid: what only a higher pressure can do is not beyond the disc."""
    plant, state = (
        law_based_of(with_driving_gas(scene, model), model).ring,
        DiscState.initial(disc=scene.disc),
    )
    return plant.unreachable_vibration(state=state, rotor=scene.rotor)


def _line_reaches(lines: tuple[LineAnswer, ...], *, settles: bool) -> bool | None:
    """Whether a given line can, which its runs show; of a default range: None when not all are sure to."""
    above = [answer.above_limit for answer in lines]
    if not any(above):
        return True
    return settles if all(answer.end == "given" for answer in lines) else None


def _silent(_: str) -> None:
    """No progress wanted."""


def _margins(scene: Scene, loop: LoopFactor, known: FactorUncertainty) -> Margins:
    settings = scene.controller
    error = abs(settings.assumed_lag_angle - scene.rotor.lag_angle)
    fixed = settings.kind != "law_based"
    return loop_margins(
        loop_factor=loop.value if fixed and loop.value else 1.0,
        gain_uncertainty=known.total,
        phase_uncertainty=known.widths.lag_angle + error,
        integral=settings.period / (settings.integral_time or math.inf) if fixed else 0.0,
        derivative=settings.derivative_time / settings.period if fixed else 0.0,
    )


def tuning_document(tuning: Tuning) -> dict[str, Any]:
    """A tuning as a JSON document in SI; null: there is none, or a quantile is not reached."""
    loop, margins, settling, scene = tuning.loop, tuning.margins, tuning.settling, tuning.scene
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": scene.balancer,
        "law": tuning.law,
        "controller": scene.controller.kind,
        "status": tuning.status,
        "gain": tuning.gain,
        "loop_factor": loop.value,
        "loop_factor_limit": loop.limit,
        "present": {"loop_factor": tuning.present.value, "unstable": tuning.present.unstable},
        "vibration_rate_m_per_s": loop.rate,
        "stationary_deviation_m": _finite(loop.deviation),
        "margins": None
        if margins is None
        else {name: _finite(value) for name, value in asdict(margins).items()}
        | {"left_gain_factor": margins.left_gain_factor, "left_phase": margins.left_phase},
        "uncertainty": [asdict(part) for part in tuning.contributions],
        "first_gas_time_s": tuning.first_gas_time,
        "last_gas_time_s": tuning.last_gas_time,
        "minimum_gas_time_s": scene.controller.minimum_gas_time,
        "smallest_correction_m": tuning.smallest_correction,
        "dead_zone_m": tuning.dead_zone,
        "dead_time_s": list(tuning.dead_times) or None,
        "gas_time_offset_s": list(scene.controller.offsets(scene.disc.chambers)),
        "change": tuning.change,
        "tried": [] if tuning.search is None else [asdict(row) for row in tuning.search.tried],
        "reachable_limit_m": None if tuning.search is None else tuning.search.limit,
        "faster_valve": None if tuning.search is None else tuning.search.valve,
        "shorter_opening_s": None if tuning.search is None else tuning.search.opening,
        "limit_m": scene.controller.limit,
        "beyond_capacity_m": tuning.beyond_capacity,
        "reachable": tuning.reachable,
        "gas_line": line_document(tuning.gas_line),
        "settling_time_s": None if settling is None else settling.quantiles,
        "fraction_settled": None if settling is None else settling.settled.value,
        "fraction_settled_95": None if settling is None else [settling.settled.low, settling.settled.high],
        "fraction_beyond_capacity": None if settling is None else settling.beyond_capacity,
        "fraction_beyond_pressure": None if settling is None else settling.beyond_pressure,
        "fraction_drifted": None if settling is None else settling.drifted,
        "runs": 0 if settling is None else settling.runs,
        "left_out": [],
        "neglected": asdict(neglected_in_injections(tuning.models_used)),
        "models_used": [asdict(used) for used in tuning.models_used],
    }


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
