"""The law-based algorithm: valve-open times from the flow law, and an estimated influence coefficient."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from ringbalance.controller.algorithms.built_in import BuiltIn, TargetVector, Trial, open_valve
from ringbalance.controller.algorithms.law_steps import (
    AXIS_X,
    AXIS_Y,
    CHANGE,
    LAST_MOMENT_X,
    LAST_MOMENT_Y,
    LAST_X,
    LAST_Y,
    LEARNT_X,
    LEARNT_Y,
    MOMENT_NOW,
    NOW_X,
    NOW_Y,
    SEEN_X,
    SEEN_Y,
    VARIANCE,
    change_of,
    is_try,
    learn,
    see_response,
    set_bounds,
    set_should,
    split,
)
from ringbalance.controller.liquid_ring.plant import LiquidRing
from ringbalance.controller.loop_records import LAW_BASED, MEMORY
from ringbalance.controller.rotor import chamber_directions
from ringbalance.controller.terms import dynamics_of
from ringbalance.reduced_model.injection.column import steady
from ringbalance.reduced_model.injection.dynamics import EVENTS, RELATIVE_ERROR, Event, X
from ringbalance.reduced_model.injection.events import command
from ringbalance.reduced_model.injection.lift import shown
from ringbalance.reduced_model.injection.march import SPARE, advance, opening_to
from ringbalance.reduced_model.injection.moment import fill_for_moment, pair_moment, tabulate_moment
from ringbalance.reduced_model.injection.pair import at_rest
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene.arrays import ComplexArray, FloatArray, Record, Records
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.compiled import in_place

PRIOR_STANDARD_DEVIATION: Final = 0.5
"""Standard deviation, relative, of the assumed influence coefficient before the first operation."""
LEAST_LAW_STANDARD_DEVIATION: Final = 0.05
"""Lower bound of the relative standard deviation of a flow law's velocity."""
FILL_ERROR: Final = 1e-3
"""Tolerance in fill ratio of a valve-open time, as a multiple of the error allowed to a step."""
_BLOCKED: Final = EVENTS.index(Event.BLOCKED)
_EMPTY: Final = EVENTS.index(Event.EMPTY)
_FULL: Final = EVENTS.index(Event.FULL)


@dataclass(frozen=True, kw_only=True, eq=False)
class LawBased(BuiltIn):
    """Valve-open times that remove the whole residual in one operation, t = (V/S) integral dx/u(x) for each
    pair.

    The residual unbalance V/K needs a change of the disc's moment; the moment curve turns it into fill
    ratios of the pairs, the flow law into valve-open times.  The chambers' fills are estimated by the same
    law from the start on.  After each operation K is estimated again from the vibration's response (`learn`),
    so a wrong influence coefficient, lag angle or speed of the flow spoils only the first operation.  There
    is no gain to tune.

    Limits: a valve whose time is below minimum_gas_time does not open, one above maximum_gas_time is cut to
    it.  Where by the law nothing flows, or a chamber is empty, its valve opens all the same, since fills and
    law are only assumed: for one period, or for the time that the missing moment would take.
    At or below `limit` the algorithm rests.  A dropped sample or a NaN changes nothing: no valve opens, and
    the next usable sample shows the response.
    """

    model: BalancerModel
    """Model that the algorithm assumes; that of the controlled disc may differ."""
    relative_error: float = RELATIVE_ERROR
    """Relative error allowed to an integration step of the estimated liquid."""

    @cached_property
    def ring(self) -> LiquidRing:
        """The disc as the algorithm assumes it."""
        scene, model = self.scene, self.model
        residual = residual_fill_ratio(scene, law=model.flow)
        dynamics = dynamics_of(scene=scene, model=model, modelled=(), residual_fill=residual)
        return LiquidRing(
            model=model,
            chambers=scene.disc.chambers,
            total=2 * scene.disc.initial_fill,
            dynamics=replace(dynamics, relative_error=self.relative_error),
        )

    @cached_property
    def plant(self) -> Records:
        """The assumed disc, type `PLANT`, shape (1,)."""
        plant = self.ring.dynamics.plant(total=self.ring.total)
        tabulate_moment(plant[0], self.ring.model, total=self.ring.total)
        return plant

    @cached_property
    def law_standard_deviation(self) -> float:
        """Standard deviation of the law's velocity at the start, relative."""
        level, flow = self.ring.total / 2, self.ring.model.flow
        answer = flow.evaluate(
            fill_ratio=level, opposite_fill_ratio=level, gas_pressure=self.ring.gas_pressure
        )
        velocity = abs(float(answer.velocity))
        relative = float(answer.uncertainty) / (2 * velocity) if velocity > 0 else 0.0
        return max(relative, LEAST_LAW_STANDARD_DEVIATION)

    def fill(self, loop: Record, run: Record) -> None:
        """Write the settings, with the assumed influence coefficient and its variance."""
        super().fill(loop, run)
        scene, chambers, total = self.scene, self.ring.chambers, self.ring.total
        influence, sensor = scene.controller.assumed_influence, scene.sensor
        loop["algorithm"], loop["influence"] = LAW_BASED, influence
        loop["assumed_amplitude_noise"] = sensor.amplitude_noise
        loop["assumed_phase_noise"] = sensor.phase_noise
        loop["probe"], loop["law_deviation"] = scene.controller.period, self.law_standard_deviation
        loop["axis"][: chambers // 2] = chamber_directions(chambers)[: chambers // 2]
        lowest = total - self.ring.model.flow.max_fill_ratio
        loop["least_fill"] = max(min(self.ring.residual_fill, total / 2), lowest)
        run["before_time"] = math.inf
        run["memory"] = first_memory(loop["axis"][: chambers // 2])
        run["memory"][[LEARNT_X, LEARNT_Y]] = influence.real, influence.imag
        run["memory"][VARIANCE] = abs(PRIOR_STANDARD_DEVIATION * influence) ** 2

    def liquid(self) -> Records:
        """Pairs at rest at equal fills, and spare ones for trial integrations."""
        return self._liquid.copy()

    @cached_property
    def _liquid(self) -> Records:
        level = at_rest(self.plant, fill=self.ring.total / 2)
        return np.repeat(level, self.ring.chambers // 2 + SPARE)


def first_memory(axes: ComplexArray) -> FloatArray:
    """Memory of `law_steps` with the directions of the pairs, all else zero."""
    row = np.zeros(MEMORY)
    for pair, axis in enumerate(axes):
        row[change_of(0, pair) + AXIS_X], row[change_of(0, pair) + AXIS_Y] = axis.real, axis.imag
    return row


def controller_of(scene: Scene, model: BalancerModel, *, relative_error: float = RELATIVE_ERROR) -> BuiltIn:
    """The control algorithm of a scene. Args: `model`, `relative_error`: as in `LawBased`."""
    kind = scene.controller.kind
    if kind == "law_based":
        return LawBased(scene=scene, model=model, relative_error=relative_error)
    return TargetVector(scene=scene) if kind == "target_vector" else Trial(scene=scene)


@in_place
def law_based_step(
    loop: Record, plant: Record, run: Record, liquid: Record, notes: FloatArray, w: FloatArray
) -> None:
    """One step of `LawBased` on a usable sample; `liquid` has the pairs as estimated."""
    _follow(loop, plant, run, liquid, notes, w)
    run.before_time = run.time
    run.before_amplitude, run.before_phase = run.seen_amplitude, run.seen_phase
    for i in range(loop.chambers // 2):
        run.given[i] = 0.0
    if run.seen_amplitude <= loop.rest_limit:
        run.resting = 1
        return
    _aim(loop, plant, run, liquid, w)
    for i in range(loop.chambers // 2):
        run.given[i], run.given_side[i] = run.asked[i], run.side[i]


@in_place
def _vector(amplitude: float, phase: float) -> complex:
    return complex(amplitude * math.cos(phase), amplitude * math.sin(phase))


@in_place
def _disc_moment(loop: Record, plant: Record, liquid: Record) -> complex:
    moment = 0j
    for i in range(loop.chambers // 2):
        moment += loop.axis[i] * pair_moment(plant, shown(plant, liquid[i], liquid[i].state[X]))
    return moment


@in_place
def _follow(
    loop: Record, plant: Record, run: Record, liquid: Record, notes: FloatArray, w: FloatArray
) -> None:
    """Integrate the liquid to the sample's time, and update the influence coefficient by the response."""
    interval = run.time - run.before_time
    if not interval > 0.0:
        return
    half, opened, before = loop.chambers // 2, False, _disc_moment(loop, plant, liquid)
    m = run.memory
    for i in range(half):
        m[change_of(0, i) + MOMENT_NOW] = _along(plant, shown(plant, liquid[i], liquid[i].state[X]))
        if run.given[i] > 0.0:
            opened = True
            offset = loop.offset[i + half * run.given_side[i]]
            acting = min(max(run.given[i] - offset, 0.0), interval)
            if acting > 0.0:
                command(plant, liquid[i], run.given_side[i], acting)
        liquid[i].steps = 0
        advance(plant, liquid[i], interval, notes, 1, 0, w)
        moment = _along(plant, shown(plant, liquid[i], liquid[i].state[X]))
        set_should(m, 0, i, moment, run.given[i] > 0.0)
    if opened:
        seen = _vector(run.seen_amplitude, run.seen_phase)
        last = _vector(run.before_amplitude, run.before_phase)
        after = _disc_moment(loop, plant, liquid)
        m[SEEN_X], m[SEEN_Y], m[LAST_X], m[LAST_Y] = seen.real, seen.imag, last.real, last.imag
        m[NOW_X], m[NOW_Y] = after.real, after.imag
        m[LAST_MOMENT_X], m[LAST_MOMENT_Y] = before.real, before.imag
        noise = loop.assumed_amplitude_noise**2, loop.assumed_phase_noise**2
        if see_response(m, 0, half, noise[0], noise[1]):
            learn(m, 0, noise[0], noise[1], loop.law_deviation**2, abs(loop.influence))


@in_place
def _aim(loop: Record, plant: Record, run: Record, liquid: Record, w: FloatArray) -> None:
    """Command the valve-open times that remove the residual."""
    half, lowest, m = loop.chambers // 2, loop.least_fill, run.memory
    highest = plant.total - lowest
    least, most = _along(plant, lowest), _along(plant, highest)
    for i in range(half):
        now = _along(plant, shown(plant, liquid[i], liquid[i].state[X]))
        set_bounds(m, 0, i, now, least, most)
    wanted_moment = -_vector(run.seen_amplitude, run.seen_phase) / complex(m[LEARNT_X], m[LEARNT_Y])
    split(m, 0, half, wanted_moment.real, wanted_moment.imag)
    for i in range(half):
        change = m[change_of(0, i) + CHANGE]
        if change != 0.0:
            fill = shown(plant, liquid[i], liquid[i].state[X])
            wanted = fill_for_moment(plant, _along(plant, fill) + change, lowest, highest)
            side = 0 if wanted < fill else 1
            if is_try(m, 0, i, side):
                time = _try_time(loop, plant, abs(wanted - fill))
            else:
                time = _gas_time(loop, plant, liquid, i, side, wanted, w)
            chamber = i + side * half
            open_valve(loop, run, chamber, time, loop.offset[chamber])


@in_place
def _along(plant: Record, fill: float) -> float:
    return pair_moment(plant, fill).real


@in_place
def _gas_time(
    loop: Record, plant: Record, liquid: Record, pair: int, side: int, wanted: float, w: FloatArray
) -> float:
    """Valve-open time that brings a pair to a fill of its positive chamber, t = (V/S) integral dx/u(x), s.

    At most the longest.  If the flow stalls before the target, the time until it stalls; if a chamber is then
    empty or full, the time of a try in addition.  The probe's time where nothing flows.
    """
    longest, fill = loop.maximum_gas_time, shown(plant, liquid[pair], liquid[pair].state[X])
    target, now = (plant.total - wanted, plant.total - fill) if side else (wanted, fill)
    if target >= now:
        return 0.0
    allowed = FILL_ERROR * plant.relative_error
    time = opening_to(plant, liquid, pair, liquid.size - SPARE, side, target, longest, allowed, w)
    motion = liquid[liquid.size - 1]
    if motion.event == _BLOCKED:
        return float(loop.probe)
    if time <= longest:
        return time
    lowest = max(0.0, plant.total - plant.max_fill_ratio)
    flows = now > lowest
    if flows and motion.ended == 0.0:
        return float(longest)
    # A chamber that an earlier command has emptied does not flow again.
    ended, more = motion.ended if flows else 0.0, 0.0
    if motion.event in (_EMPTY, _FULL):
        reached = shown(plant, motion, motion.state[X])
        more = _try_time(loop, plant, (plant.total - reached if side else reached) - target)
    return float(min(ended + more, longest))


@in_place
def _try_time(loop: Record, plant: Record, change: float) -> float:
    """Valve-open time for a change of a fill where no more liquid is expected, s, by the flow at equal fills.

    At most the probe's time, for the gas may move nothing; if it moves liquid, the response shows it.
    """
    level = plant.total / 2.0
    speed = steady(plant, level, level, plant.gas_pressure, 0.0, True, 0.0)[0]
    return float(min(change * plant.chamber_volume / (plant.tube_area * max(speed, 1e-12)), loop.probe))
