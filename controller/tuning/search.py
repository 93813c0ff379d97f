"""What to change so that the runs of a tuned loop settle: settings that are tried in turn."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from ringbalance.controller.algorithms.by_name import target_vector_of
from ringbalance.controller.liquid_ring.loop_factor import loop_factor, with_driving_gas
from ringbalance.controller.tuning.dead_time import compensated, dead_times, offset_text
from ringbalance.controller.tuning.recommendation import FactorUncertainty, recommended_gain
from ringbalance.controller.tuning.settling import Progress, SettlingTimes, many_runs, tried
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene

_INTEGRAL_PERIODS: Final = 5.0
"""Integral time in periods: it pushes a residual that stands still over the dead time in some commands."""
_GAINS: Final = (0.6, 1.6)
"""Times the recommended gain, lower where an injection moves more than its dead time allows for."""
_PRESSURES: Final = (1.25, 1.5)
"""Times the scene's: a shorter dead time, and a faster flow."""
LIMITS: Final = (1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0)
"""Times the scene's, of which the lowest that is reached is reported."""
_OPENINGS: Final = (0.5, 0.2, 0.1)
"""Times the scene's shortest valve-open time, likewise."""
_PROMISING: Final = 0.5
"""Fraction of the runs from which on an integral part may make up for the rest."""
VALVES: Final = (2.0, 3.0, 5.0, 10.0)
"""Times the scene's conductance and over its lag, of which the slowest that settles is reported."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Settings for a scene's controller."""

    scene: Scene
    change: str
    """From the scene with its recommended gain, as keys and values; empty: none."""
    dead: tuple[float, ...]
    """Dead times of its chambers, s; empty where runs do not model the filling of gas."""


@dataclass(frozen=True, kw_only=True)
class _Tried:
    """What became of a candidate in a few short runs."""

    change: str
    settled: float
    """Fraction of the runs."""
    runs: int


@dataclass(frozen=True, kw_only=True)
class Search:
    """What was found."""

    best: Candidate
    settles: bool
    """Whether all of its few runs settle."""
    needs: float | None
    """s, in which they have settled and held; None: they have not."""
    tried: tuple[_Tried, ...]
    limit: float | None = None
    """Lowest limit of the vibration that 95 % of many runs reach where the scene's is not reached, m."""
    valve: float | None = None
    """Times as fast a valve and line, with which they reach the scene's limit."""
    opening: float | None = None
    """Shortest valve-open time with which they do, s; tried where the scene's is too long for the limit."""

    def needs_more_than(self, time: float) -> bool:
        """Whether its few runs settle, and that takes longer than a time, s."""
        return self.needs is not None and self.needs > time


def recommended(scene: Scene, model: BalancerModel, known: FactorUncertainty) -> Candidate | None:
    """The scene with its recommended gain, and with offsets where the dead time asks for them.

    The law-based algorithm learns what an injection moves, dead time included; offsets are recommended for it
    only where a few runs settle better with them.
    Returns: None where nothing flows, or the limit is below the noise.
    """
    gain = recommended_gain(
        scene, model, loop=loop_factor(scene, model, target_vector_of(scene)), uncertainty=known
    )
    if gain == 0:
        return None
    learns = scene.controller.kind == "law_based"
    settings = replace(scene.controller, proportional=gain, kind="target_vector")
    kept = scene if learns else replace(scene, controller=settings)
    dead = dead_times(kept, model)
    bare = Candidate(scene=kept, change="", dead=dead)
    offset = _candidate(bare, compensated(kept, model, dead))
    return _faster(bare, offset, model, known) if learns and offset.change else offset


def _faster(bare: Candidate, offset: Candidate, model: BalancerModel, known: FactorUncertainty) -> Candidate:
    """Of two the one of which more of a few runs settle, or as many with the slowest sooner."""

    def rank(each: Candidate) -> tuple[float, float]:
        found = tried(each.scene, model, known.widths)
        return found.settled.value, -(found.quantiles["p95"] or math.inf)

    return max(bare, offset, key=rank)


def _candidate(before: Candidate, scene: Scene, *changes: str) -> Candidate:
    given = scene.controller.gas_time_offset
    if given and given != before.scene.controller.gas_time_offset:
        changes = (*changes, offset_text(given))
    return Candidate(scene=scene, change=", ".join(changes), dead=before.dead)


def search(
    scene: Scene,
    model: BalancerModel,
    known: FactorUncertainty,
    *,
    base: Candidate,
    settled: float,
    told: Progress,
) -> Search:
    """Try one candidate after the other until one settles.

    Args: `settled`: fraction of many runs that settle in the scene's time limit with `base`, which is all
        right only where a few runs show that more time would do.
    """
    rows: list[_Tried] = []
    best, most = base, -1.0

    def candidates() -> Iterator[Candidate]:
        yield base
        yield from _others(scene, model, known, base)
        yield from _pushed(best)

    for each in candidates():
        what = each.change or "the recommended gain alone"
        told(f"{what} ...")
        found = tried(each.scene, model, known.widths)
        rows.append(_Tried(change=what, settled=found.settled.value, runs=found.runs))
        held = (found.quantiles["p95"] or 0.0) + scene.controller.hold_time
        enough = each is base and held <= scene.run.time_limit
        share = min(found.settled.value, settled) if enough else found.settled.value
        if share > most:
            best, most = each, share
        if most >= 1.0:
            return Search(best=each, settles=True, needs=held, tried=tuple(rows))
    return Search(best=best, settles=False, needs=None, tried=tuple(rows))


def _others(
    scene: Scene, model: BalancerModel, known: FactorUncertainty, base: Candidate
) -> Iterator[Candidate]:
    settings, given = base.scene.controller, replace(base, scene=scene)
    if base.dead and settings.gas_time_offset != base.dead:
        offset = replace(base.scene, controller=replace(settings, gas_time_offset=base.dead))
        yield _candidate(given, offset)
    if settings.kind == "target_vector":
        yield from _pushed(base)
        for factor in _GAINS:
            changed = replace(settings, proportional=factor * settings.proportional)
            text = f"controller.proportional = {_gain(changed.proportional)}"
            yield _candidate(given, replace(base.scene, controller=changed), text)
    raised = (factor * scene.gas.pressure for factor in _PRESSURES)
    driving = with_driving_gas(scene, model).gas.pressure
    for pressure in sorted({*raised, driving} - {scene.gas.pressure}):
        higher = recommended(replace(scene, gas=replace(scene.gas, pressure=pressure)), model, known)
        if higher is None:
            continue
        texts = [f'gas.pressure = "{pressure / 1e6:.3g} MPa"']
        if settings.kind == "target_vector":
            texts.append(f"controller.proportional = {_gain(higher.scene.controller.proportional)}")
        yield _candidate(replace(higher, scene=scene), higher.scene, *texts)


def _pushed(best: Candidate) -> Iterator[Candidate]:
    """The same with an integral part, where the target-vector algorithm has none as fast."""
    settings = best.scene.controller
    integral = _INTEGRAL_PERIODS * settings.period
    if settings.kind == "target_vector" and (settings.integral_time or math.inf) > integral:
        pushed = replace(best.scene, controller=replace(settings, integral_time=integral))
        text = f'controller.integral_time = "{integral:.3g} s"'
        change = ", ".join(t for t in (text, best.change) if t)
        yield replace(best, scene=pushed, change=change)


def _gain(gain: float) -> str:
    return f'"{gain * 1e-6:.3g} s/um"'


def with_ways_out(
    found: Search,
    scene: Scene,
    model: BalancerModel,
    known: FactorUncertainty,
    *,
    members: int,
    runs: int,
    told: Progress,
) -> Search:
    """What else lets 95 % of as many runs settle as the recommended settings are judged by."""
    rows, asked = list(found.tried), replace(scene, gas=found.best.scene.gas)

    def settled(each: Candidate, text: str) -> SettlingTimes:
        what = ", ".join(t for t in (text, each.change) if t)
        told(f"{what} ...")
        many = many_runs(each.scene, model, known.widths, members=members, runs=runs, told=lambda _: None)
        rows.append(_Tried(change=what, settled=many.settled.value, runs=many.runs))
        return many

    def settles(each: Candidate, text: str) -> bool:
        found = settled(each, text)
        if found.quantiles["p95"] is None and found.settled.value >= _PROMISING:
            return any(settled(one, text).quantiles["p95"] is not None for one in _pushed(each))
        return found.quantiles["p95"] is not None

    def first(ways: Iterator[tuple[float, Scene, str]]) -> float | None:
        for value, changed, text in ways:
            each = recommended(changed, model, known)
            if each is not None and settles(each, text):
                return value
        return None

    found = replace(
        found,
        limit=first(_limits(asked)),
        valve=first(_valves(asked)),
        opening=first(_openings(asked, found.best)),
    )
    return replace(found, tried=tuple(rows))


def _openings(scene: Scene, best: Candidate) -> Iterator[tuple[float, Scene, str]]:
    """Shorter ones, where at the limit the gain asks for less than the scene's."""
    settings = scene.controller
    if settings.minimum_gas_time <= best.scene.controller.proportional * settings.limit:
        return
    for time in (factor * settings.minimum_gas_time for factor in _OPENINGS):
        shorter = replace(scene, controller=replace(settings, minimum_gas_time=time))
        yield time, shorter, f'controller.minimum_gas_time = "{1e3 * time:.3g} ms"'


def _limits(scene: Scene) -> Iterator[tuple[float, Scene, str]]:
    for limit in (factor * scene.controller.limit for factor in LIMITS):
        wider = replace(scene, controller=replace(scene.controller, limit=limit))
        yield limit, wider, f'controller.limit = "{1e6 * limit:.3g} um"'


def _valves(scene: Scene) -> Iterator[tuple[float, Scene, str]]:
    gas = scene.gas
    if gas.conductance is None:
        return
    for factor in VALVES:
        lag = None if gas.valve_lag is None else gas.valve_lag / factor
        faster = replace(gas, conductance=factor * gas.conductance, valve_lag=lag)
        yield factor, replace(scene, gas=faster), f"a valve and line {factor:.3g} times as fast"
