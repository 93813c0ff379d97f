"""The one-by-one trial step: next chamber on a rise, variable step, phase never read."""

from __future__ import annotations

import math
from dataclasses import replace

from ringbalance.controller.algorithms.algorithm import Command, Measurement
from ringbalance.controller.algorithms.built_in import Trial
from ringbalance.controller.stepped import Memory, Stepped
from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene

PAPER = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
SETTINGS = replace(
    PAPER.controller,
    sequence=("A", "C", "B", "D"),
    limit=0.05e-6,
    first_trial=0.05,
    long_step=0.2,
    short_step=0.01,
    fine_below=0.8e-6,
    minimum_gas_time=1e-3,
    maximum_gas_time=5.0,
)
TRIAL = Stepped(Trial(scene=replace(PAPER, controller=SETTINGS)))


def run(amplitudes: list[float]) -> list[tuple[int, float] | None]:
    """Chamber and valve-open time for amplitudes in micrometres; None where no valve opens."""
    state, answers = TRIAL.start(), []
    for index, amplitude in enumerate(amplitudes):
        seen = Measurement(time=float(index), amplitude=amplitude * 1e-6, phase=math.nan)
        state, command = TRIAL.step(state, seen)
        answers.append((command.valves[0].chamber, command.valves[0].duration) if command.valves else None)
    return answers


def tried(amplitudes: tuple[float, ...]) -> Memory:
    """The state after some amplitudes, m."""
    state = TRIAL.start()
    for index, amplitude in enumerate(amplitudes):
        state, _ = TRIAL.step(state, Measurement(time=float(index), amplitude=amplitude, phase=0.0))
    return state


def test_a_rise_moves_on_and_a_fall_stays() -> None:
    assert run([10, 10.2, 9.8, 8.0, 8.1, 8.3, 8.2]) == [
        (0, 0.05),
        (2, 0.05),
        (2, 0.2),
        (2, 0.2),
        (1, 0.05),
        (3, 0.05),
        (3, 0.2),
    ]


def test_the_sequence_starts_again_after_its_last_chamber() -> None:
    assert [answer[0] for answer in run([5, 6, 7, 8, 9]) if answer] == [0, 2, 1, 3, 0]


def test_no_change_counts_as_no_fall() -> None:
    assert run([5, 5]) == [(0, 0.05), (2, 0.05)]


def test_steps_are_short_near_the_goal_first_trials_too() -> None:
    assert run([0.79, 0.7, 0.75, 0.6]) == [(0, 0.01), (0, 0.01), (2, 0.01), (2, 0.01)]
    assert run([0.9, 0.8]) == [(0, 0.05), (0, 0.2)]


def test_it_rests_at_the_limit_and_keeps_its_chamber() -> None:
    state = tried((1e-6, 2e-6, 3e-6))
    state, command = TRIAL.step(state, Measurement(time=0.0, amplitude=0.05e-6, phase=0.0))
    assert command == Command(resting=True)
    _, again = TRIAL.step(state, Measurement(time=1.0, amplitude=0.2e-6, phase=0.0))
    assert (again.valves[0].chamber, again.valves[0].duration) == (1, 0.01)
