"""The target-vector step: pure, PID by hand, limits, and what it does with a bad sample."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.controller.algorithms.algorithm import Command, Measurement
from ringbalance.controller.algorithms.built_in import OnReversal, TargetVector
from ringbalance.controller.algorithms.target_steps import (
    DIRECTIONS,
    FIRST_CHAMBER,
    INTEGRAL,
    nearest,
    split,
)
from ringbalance.controller.algorithms.valve_steps import AT_RESIDUAL, OPEN_TIME, PER_CHAMBER
from ringbalance.controller.rotor import chamber_directions
from ringbalance.controller.stepped import Memory, Stepped
from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene

PAPER = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
SETTINGS = replace(
    PAPER.controller,
    assumed_lag_angle=0.3,
    limit=1e-7,
    proportional=1e5,
    integral_time=20.0,
    derivative_time=0.5,
    minimum_gas_time=1e-3,
    maximum_gas_time=5.0,
)


def pid(on_reversal: OnReversal = "reset", **settings: Any) -> Stepped:
    """Four chambers, without offsets."""
    scene = replace(PAPER, controller=replace(SETTINGS, **settings))
    return Stepped(TargetVector(scene=scene, on_reversal=on_reversal))


PID = pid()


def sample(time: float, amplitude: float, phase: float = 0.2) -> Measurement:
    return Measurement(time=time, amplitude=amplitude, phase=phase)


def components(
    *, chambers: int, angle: float, length: float, at_residual: tuple[bool, ...] = ()
) -> tuple[tuple[int, float], ...]:
    """Chamber and share of a vector split over the directions on either side of it."""
    c, w = np.zeros(DIRECTIONS + 3 * chambers), np.zeros(FIRST_CHAMBER + PER_CHAMBER * chambers)
    c[0], c[6], c[DIRECTIONS::3], c[DIRECTIONS + 1 :: 3] = (
        chambers,
        1e9,
        *chamber_directions(chambers).view(float).reshape(-1, 2).T,
    )
    w[FIRST_CHAMBER + AT_RESIDUAL :: PER_CHAMBER] = at_residual or (False,) * chambers
    split(c, w, math.cos(angle), math.sin(angle), length)
    opened = w[FIRST_CHAMBER + OPEN_TIME :: PER_CHAMBER]
    result = np.flatnonzero(opened)
    if result.size < 2 < chambers:
        before = nearest(c, math.cos(angle), math.sin(angle))
        result = np.array([before, (before + 1) % chambers])
    result = result[::-1] if chambers > 2 and result[1] - result[0] > chambers / 2 else result
    return tuple((int(i), float(opened[i])) for i in result)


def integral(state: Memory) -> float:
    """What the algorithm has integrated, m s."""
    return float(state.run["memory"][0, INTEGRAL])


def gas(command: Command) -> dict[int, float]:
    return {valve.chamber: valve.duration for valve in command.valves}


def vector_time(command: Command) -> float:
    """Length of the commanded vector for four chambers."""
    return math.hypot(*gas(command).values())


@given(
    n=st.sampled_from([4, 6, 8, 10]),
    angle=st.floats(-20, 20),
    length=st.floats(0, 10),
)
def test_components_add_up_to_the_vector(n: int, angle: float, length: float) -> None:
    shares = components(chambers=n, angle=angle, length=length)
    directions = chamber_directions(n)
    total = sum(share * directions[chamber] for chamber, share in shares)
    assert total == pytest.approx(
        length * complex(math.cos(angle), math.sin(angle)), abs=1e-13 * max(length, 1)
    )
    assert all(0 <= share <= length * (1 + 1e-12) for _, share in shares)
    first, second = (chamber for chamber, _ in shares)
    assert (second - first) % n == 1


@pytest.mark.parametrize(
    ("degrees", "first", "second"), [(30, 0, 1), (120, 1, 2), (210, 2, 3), (300, 3, 0), (-60, 3, 0)]
)
def test_four_chambers_take_cosine_and_sine(degrees: float, first: int, second: int) -> None:
    shares = dict(components(chambers=4, angle=math.radians(degrees), length=2.0))
    assert shares[first] == pytest.approx(2 * math.cos(math.radians(30)))
    assert shares[second] == pytest.approx(2 * math.sin(math.radians(30)))


@pytest.mark.parametrize(("degrees", "chamber"), [(60, 0), (120, 1), (-120, 1)])
def test_two_chambers_take_the_component_along_their_axis(degrees: float, chamber: int) -> None:
    assert components(chambers=2, angle=math.radians(degrees), length=2.0) == (
        (chamber, pytest.approx(1.0, rel=1e-12)),
    )


@given(
    n=st.sampled_from([4, 6, 8, 10]),
    angle=st.floats(-20, 20),
    without=st.frozensets(st.integers(0, 9)),
)
def test_a_chamber_at_its_residual_fill_is_passed_over_where_the_others_can_form_the_vector(
    n: int, angle: float, without: frozenset[int]
) -> None:
    at_residual = tuple(place in without for place in range(n))
    shares = components(chambers=n, angle=angle, length=1.0, at_residual=at_residual)
    directions, wanted = chamber_directions(n), np.exp(1j * angle)
    assert sum(share * directions[chamber] for chamber, share in shares) == pytest.approx(wanted, abs=1e-12)
    assert all(share >= 0 for _, share in shares)
    # What is left forms the vector if some of it lies on either side, less than half a turn apart.
    left = [directions[place] for place in range(n) if not at_residual[place]]
    turns = np.sort(np.angle(np.array(left) / wanted)) if left else np.zeros(0)
    sides = turns[turns <= 1e-12], turns[turns >= -1e-12]
    forms = all(side.size for side in sides) and sides[1][0] - sides[0][-1] < math.pi - 1e-9
    used = {chamber for chamber, share in shares if share > 1e-9}
    if forms:
        assert not any(at_residual[chamber] for chamber in used)
    if n == 4:
        assert used == {
            chamber for chamber, share in components(chambers=4, angle=angle, length=1.0) if share > 1e-9
        }


def test_gas_goes_to_the_chambers_near_the_unbalance() -> None:
    # Phase 0.2 and lag 0.3: the unbalance lies at 0.5 rad, between A and B.
    _, command = PID.step(PID.start(), sample(0.0, 4e-6))
    assert gas(command) == pytest.approx({0: 0.4 * math.cos(0.5), 1: 0.4 * math.sin(0.5)})
    assert not command.resting


def test_pid_by_hand_with_the_actual_interval() -> None:
    state, first = PID.step(PID.start(), sample(1.0, 4e-6))
    assert vector_time(first) == pytest.approx(0.4)
    state, second = PID.step(state, sample(2.5, 3e-6))
    area = (4e-6 + 3e-6) / 2 * 1.5
    assert vector_time(second) == pytest.approx(1e5 * (3e-6 + area / 20 + 0.5 * (3e-6 - 4e-6) / 1.5))
    state, third = PID.step(state, sample(2.9, 2.5e-6))
    area += (3e-6 + 2.5e-6) / 2 * 0.4
    assert vector_time(third) == pytest.approx(1e5 * (2.5e-6 + area / 20 + 0.5 * (2.5e-6 - 3e-6) / 0.4))
    assert integral(state) == pytest.approx(area)


def test_without_an_integral_time_there_is_no_integral_part() -> None:
    pd = pid(integral_time=None, derivative_time=0.0)
    state, _ = pd.step(pd.start(), sample(0.0, 4e-6))
    _, command = pd.step(state, sample(100.0, 4e-6))
    assert vector_time(command) == pytest.approx(0.4)


def test_the_integral_stands_still_while_the_output_is_cut() -> None:
    state, _ = PID.step(PID.start(), sample(0.0, 4e-6))
    held, command = PID.step(state, sample(1.0, 1e-3))
    assert integral(held) == integral(state) == 0.0
    assert vector_time(command) == pytest.approx(5.0)


def test_a_long_command_is_cut_along_its_direction() -> None:
    _, command = PID.step(PID.start(), sample(0.0, 1e-3))
    assert gas(command) == pytest.approx({0: 5 * math.cos(0.5), 1: 5 * math.sin(0.5)})


def test_a_short_share_is_not_executed() -> None:
    # 0.4 s at 0.002 rad: the share of B is 0.8 ms, below the valves' 1 ms.
    _, command = PID.step(PID.start(), sample(0.0, 4e-6, phase=-0.298))
    assert gas(command) == pytest.approx({0: 0.4}, rel=1e-5)
    _, none = pid(minimum_gas_time=1.0).step(PID.start(), sample(0.0, 4e-6))
    assert none.valves == ()
    assert none.reason
    assert not none.resting


def test_the_integral_is_dropped_when_the_residual_has_turned_round() -> None:
    accumulating = pid("accumulate")
    for own, expected in ((PID, 0.0), (accumulating, (4e-6 + 1e-6) / 2)):
        state, _ = own.step(own.start(), sample(0.0, 4e-6))
        state, _ = own.step(state, sample(1.0, 1e-6, phase=0.2 + math.pi))
        assert integral(state) == pytest.approx(expected)


def test_a_falling_amplitude_never_asks_for_negative_gas() -> None:
    eager = pid(derivative_time=50.0)
    state, _ = eager.step(eager.start(), sample(0.0, 4e-6))
    _, command = eager.step(state, sample(1.0, 1e-6))
    assert command.valves == ()


@pytest.mark.parametrize("amplitude", [0.0, 0.5e-7, 1e-7])
def test_it_rests_at_and_below_the_limit_and_forgets(amplitude: float) -> None:
    state, _ = PID.step(PID.start(), sample(0.0, 4e-6))
    state, _ = PID.step(state, sample(1.0, 3e-6))
    state, command = PID.step(state, sample(2.0, amplitude))
    assert command == Command(resting=True)
    assert PID.step(state, sample(3.0, 4e-6))[1] == PID.step(PID.start(), sample(3.0, 4e-6))[1]


@pytest.mark.parametrize(
    "bad",
    [
        None,
        sample(2.0, math.nan),
        sample(2.0, 3e-6, phase=math.nan),
        sample(2.0, math.inf),
        sample(math.nan, 3e-6),
    ],
)
def test_a_bad_sample_holds_everything(bad: Measurement | None) -> None:
    state, _ = PID.step(PID.start(), sample(1.0, 4e-6))
    held, command = PID.step(state, bad)
    assert held is state
    assert command.valves == ()
    assert not command.resting
    _, after = PID.step(held, sample(3.0, 3e-6))
    _, expected = PID.step(state, sample(3.0, 3e-6))
    assert after == expected
    area = (4e-6 + 3e-6) / 2 * 2.0
    assert vector_time(after) == pytest.approx(1e5 * (3e-6 + area / 20 + 0.5 * -1e-6 / 2.0))


def test_two_samples_at_one_time_do_not_divide_by_zero() -> None:
    state, _ = PID.step(PID.start(), sample(1.0, 4e-6))
    _, command = PID.step(state, sample(1.0, 3e-6))
    assert vector_time(command) == pytest.approx(0.3)


@given(
    amplitudes=st.lists(st.floats(0, 1e-3), min_size=1, max_size=8),
    phases=st.lists(st.floats(-50, 50), min_size=8, max_size=8),
)
def test_the_step_is_pure_and_within_limits(amplitudes: list[float], phases: list[float]) -> None:
    state = PID.start()
    for index, (amplitude, phase) in enumerate(zip(amplitudes, phases, strict=False)):
        measurement = sample(float(index), amplitude, phase)
        kept = state.run.copy()
        once, twice = PID.step(state, measurement), PID.step(state, measurement)
        assert once == twice
        assert np.array_equal(state.run, kept)
        state, command = once
        assert all(1e-3 <= valve.duration <= 5.0 for valve in command.valves)
        assert len({valve.chamber % 2 for valve in command.valves}) == len(command.valves)
        assert math.isfinite(integral(state))
        assert integral(state) >= 0


def test_a_chamber_that_moves_nothing_is_passed_over_until_its_opposite_opens() -> None:
    """Beyond noise; six chambers, A and B on either side of the unbalance."""
    scene = liquid_ring_scene(load_scene(bundled_scene("six_chamber")))
    controller = Stepped(TargetVector(scene=scene))
    lag, between = scene.controller.assumed_lag_angle, math.radians(20.0)

    def stepped(state: Memory, time: float, vector: complex) -> tuple[Memory, set[int]]:
        seen = Measurement(time=time, amplitude=abs(vector), phase=cmath.phase(vector) - lag)
        after, command = controller.step(state, seen)
        return after, set(gas(command))

    first = cmath.rect(8e-6, between)
    state, opened = stepped(controller.start(), 0.0, first)
    assert opened == {0, 1}
    # What chamber B took away, and A not.
    b = cmath.rect(1.0, math.pi / 3)
    moved = 8e-6 * math.sin(between) / math.sin(math.pi / 3) * b
    passed, opened = stepped(state, 1.0, first - moved)
    assert opened == {5, 1}
    _, opened = stepped(state, 1.0, 0.5 * first)
    assert opened == {0, 1}
    turned, opened = stepped(passed, 2.0, -first)
    assert 3 in opened
    _, opened = stepped(turned, 3.0, first)
    assert opened == {0, 1}
    near = cmath.rect(0.08e-6, between)
    state, _ = stepped(controller.start(), 0.0, near)
    _, opened = stepped(state, 1.0, near)
    assert opened == {0, 1}
