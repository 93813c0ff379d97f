"""The disc of one member whose liquid, gas and valves have dynamics of their own, in plain numbers."""

from __future__ import annotations

import math

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.ensemble.compiled_disc import vibration
from ringbalance.controller.ensemble.compiled_records import Record
from ringbalance.controller.liquid_ring.compiled_march import advance, command, rests
from ringbalance.controller.liquid_ring.compiled_step import gas_volume
from ringbalance.controller.liquid_ring.records import P, X
from ringbalance.scene.arrays import FloatArray


@compiled
def begin(plant: Record, motion: Record, fill: float, speed: float) -> None:
    """A pair at rest, vented; `speed` is a factor on the velocity of the flow law."""
    y = motion.state
    y[:] = 0.0
    y[X], y[P], y[P + 1] = fill, plant.ambient_pressure, plant.ambient_pressure
    y[P + 2] = plant.ambient_pressure * gas_volume(plant, fill) / plant.temperature
    y[P + 3] = plant.ambient_pressure * gas_volume(plant, plant.total - fill) / plant.temperature
    motion.opens, motion.closes, motion.log_speed = math.inf, math.inf, math.log(speed)
    motion.length, motion.started, motion.ran_back = plant.first_step, fill, 0.0
    motion.fill_before, motion.least_fill = fill, fill
    motion.closing_pressure, motion.run_dry = 0.0, 0.0
    motion.primed, motion.valve_0, motion.valve_1, motion.direction = 0, 0, 0, 0
    motion.balanced, motion.stopped, motion.steps, motion.chamber = 0, 0, 0, 0
    motion.regime_start, motion.regime_end, motion.event = 0, 0, 0


@compiled
def open_valves(shared: Record, plant: Record, run: Record, motions: Record) -> None:
    """Command the one or two valves of a member."""
    for i in range(shared.chambers // 2):
        run.fill_before[i] = run.fill[i]
    command(plant, motions[run.pair], 0 if run.first else 1, run.duration)
    if run.other_pair >= 0:
        command(plant, motions[run.other_pair], 0 if run.other_first else 1, run.other_duration)


@compiled
def pass_moving(
    shared: Record, plant: Record, run: Record, motions: Record, w: FloatArray, length: float, points: int
) -> None:
    """Let a time pass, s, noting since when the amplitude is not above the limit where `simulate` records.

    `run.time` is still the one before; while valves are commanded the earlier closing is recorded, too.
    """
    half = shared.chambers // 2
    for i in range(half):
        motions[i].steps, motions[i].ran_back = 0, 0.0
    closing = length
    if run.pair >= 0 and run.other_pair >= 0:
        closing = min(run.duration, run.other_duration)
    now = 0.0
    for k in range(1, points + 1):
        early, late = length * (k - 1) / points, length * k / points
        if early < closing < late:
            _advance(shared, plant, run, motions, w, closing - now)
            _note(shared, run, run.time + closing)
            now = closing
        _advance(shared, plant, run, motions, w, late - now)
        _note(shared, run, run.time + late)
        now = late
    for i in range(half):
        run.drift = max(run.drift, motions[i].ran_back)


@compiled
def _advance(
    shared: Record, plant: Record, run: Record, motions: Record, w: FloatArray, duration: float
) -> None:
    for i in range(shared.chambers // 2):
        advance(plant, motions[i], duration, w)
        run.fill[i] = motions[i].state[X]
        run.wet[i] = 0.0 if rests(plant, motions[i]) else 1.0


@compiled
def _note(shared: Record, run: Record, time: float) -> None:
    run.real, run.imaginary = vibration(shared, run, False)
    run.amplitude, run.stale = math.hypot(run.real, run.imaginary), 1
    run.since = math.inf if run.amplitude > shared.limit else min(run.since, time)
