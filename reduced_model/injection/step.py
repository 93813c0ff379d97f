"""One step in time of a pair's states by a linearly implicit method, for non-stiff and stiff flows.

A very viscous liquid in a narrow tube answers in microseconds while the levels shift for minutes, and a gas
line is stiff towards the end of filling; an explicit method would take tiny steps.
Source: the L-stable method of order 4(3) with four stages and three evaluations, Hairer and Wanner, "Solving
Ordinary Differential Equations II" (1996), section IV.7, table 7.2.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.physics.gas import LAMINAR_RATIO, flow_shape
from ringbalance.reduced_model.injection.column import (
    accelerations,
    end_pressure,
    gas_volume,
    hydrostatic,
    line_rates,
    near_end,
    steady,
    tabled,
)
from ringbalance.reduced_model.injection.dynamics import WORK, P, Record, U, X
from ringbalance.reduced_model.injection.lift import lift_rates, lift_speed
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.platform.compiled import in_place, inlined

_STAGES: Final = 4
_GAMMA: Final = 0.57282
_A: Final = np.array([[0.0, 0.0], [2.0, 0.0], [1.867943637803922, 0.2344449711399156]])
"""Weights of earlier stages in the states of a stage; the last stage takes the rates of the one before."""
_C: Final = np.array(
    [
        [0.0, 0.0, 0.0],
        [-7.137615036412310, 0.0, 0.0],
        [2.580708087951457, 0.6515950076447975, 0.0],
        [-2.137148994382534, -0.3214669691237626, -0.6949742501781779],
    ]
)
"""Weights of earlier stages, over the length of the step, in the right-hand side of a stage."""
_B: Final = np.array([2.255570073418735, 0.2870493262186792, 0.4353179431840180, 1.093502252409163])
"""Weights of the stages in the state at the end."""
_E: Final = np.array([0.2815431932141155, 0.07276199124934920, 0.1082196201495311, 1.093502252409163])
"""Weights of the stages in the difference from the embedded method of order 3."""
_SHORTEST_STEP_S: Final = 1e-15
"""Length of a step below which its error is not checked, s."""
_REST_STEP: Final = 0.25
"""Longest step at rest while both gases change, in units of the shorter time constant of a gas."""
_SLOW_M_S: Final = 30.0
"""Velocity, m/s, below which the error is not relative: a column keeps it for some 10 ms, in which a
ten-thousandth of that moves less than 1e-6 of a chamber's liquid."""
_SAFETY: Final = 0.85
_SHRINK: Final = 0.2
_GROW: Final = 2.5
# Rows of the workspace: stages, then these.
_ERROR: Final = 4
_TRIAL: Final = 5
_RATE: Final = 6
END: Final = 7
"""Row of the workspace that holds the state at the end of a step."""
BETWEEN: Final = 8
"""Row that holds a state within a step."""
_FIRST_RATE: Final = 9
_COLUMN: Final = 10
"""Row with the derivatives of the acceleration, or of the velocity without inertia, by u, x, p and q."""
_GAS: Final = 11
"""Rows with the derivatives of one gas each: of dp/dt by p, x, u, m R, and of d(m R)/dt by p, x, m R."""


@inlined
def _column_rates(
    plant: Record, motion: Record, x: float, u: float, p: float, q: float
) -> tuple[float, float, float, float, float, float]:
    """Velocity and acceleration of the liquid; derivatives of the latter by u, x, p and q.

    Without inertia, derivatives by x, p and q of the velocity that keeps the forces in balance.
    """
    direction, primed, ambient = motion.direction, motion.primed > 0, plant.ambient_pressure
    if direction == 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    p, q = p - ambient, q - ambient
    if plant.tabled:
        flow = tabled(plant, x, p, q, primed, motion.log_speed)
        return (flow[0] if flow[0] * direction > 0.0 else 0.0), 0.0, 0.0, flow[1], 0.0, 0.0
    level, opposite_level = hydrostatic(plant, x), hydrostatic(plant, plant.total - x)
    f = plant.gas_factor
    at = (
        (f * p, f * q, level[0], opposite_level[0])
        if direction > 0
        else (f * q, f * p, opposite_level[0], level[0])
    )
    speed, lifting = u * direction, motion.lifting > 0
    if not plant.inertia and lifting:
        speed = lift_speed(plant, motion, at, x)
    elif not plant.inertia:
        speed = max(steady(plant, x, plant.total - x, p, q, primed, motion.log_speed)[0] * direction, 0.0)
    if lifting:
        rates = lift_rates(plant, motion, at, x, speed)
    else:
        rates = accelerations(plant, at, speed, direction, primed, motion.log_speed)
    by_u, by_up, by_down, by_far = rates[2], rates[3] * direction, rates[4] * direction, rates[5] * direction
    if direction > 0:
        by_x, by_p, by_q = by_up * level[1] - by_far * opposite_level[1], f * by_up, f * by_down
    else:
        by_x, by_p, by_q = by_far * level[1] - by_up * opposite_level[1], f * by_down, f * by_up
    by_x += rates[1] if lifting else 0.0
    if plant.inertia:
        least = rates[0] if lifting else min(rates[0], rates[1])
        return speed * direction, least * direction, by_u, by_x, by_p, by_q
    part = -1.0 / by_u if by_u < 0.0 else 0.0
    return speed * direction, 0.0, 0.0, part * by_x, part * by_p, part * by_q


@in_place
def _rates(plant: Record, motion: Record, w: FloatArray, row: int, out: int) -> None:
    """Rates of all states with the liquid at rest, or moving in one direction."""
    x, p, q = w[row, X], w[row, P], w[row, P + 1]
    velocity, acceleration = _column_rates(plant, motion, x, w[row, U], p, q)[:2]
    flow, ambient = plant.tube_area * velocity, plant.ambient_pressure
    w[out, X], w[out, U] = -flow / plant.chamber_volume, acceleration
    w[out, WORK], w[out, WORK + 1] = (p - ambient) * flow, -(q - ambient) * flow
    for chamber in range(2):
        w[out, P + chamber], w[out, P + 2 + chamber] = 0.0, 0.0
        if plant.line:
            gas_rates = _gas(plant, motion, w, row, chamber, flow)
            w[out, P + chamber] = gas_rates[0]
            w[out, P + 2 + chamber] = gas_rates[1] if plant.heat_capacity_ratio > 1.0 else 0.0


@inlined
def _gas(
    plant: Record, motion: Record, w: FloatArray, row: int, chamber: int, flow: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """`line_rates` of one chamber."""
    x = w[row, X] if chamber == 0 else plant.total - w[row, X]
    growth, is_open = (flow, motion.valve_0 > 0) if chamber == 0 else (-flow, motion.valve_1 > 0)
    volume = gas_volume(plant, x)
    return line_rates(plant, w[row, P + chamber], w[row, P + 2 + chamber], volume, growth, is_open)


@in_place
def _linearize(plant: Record, motion: Record, w: FloatArray) -> None:
    """The rates at the start of a step, and their derivatives."""
    y, start = motion.state, w[_FIRST_RATE]
    for i in range(8):
        w[_TRIAL, i] = y[i]
    x, p, q = y[X], y[P], y[P + 1]
    velocity, acceleration, by_u, by_x, by_p, by_q = _column_rates(plant, motion, x, y[U], p, q)
    w[_COLUMN, 0], w[_COLUMN, 1], w[_COLUMN, 2], w[_COLUMN, 3] = by_u, by_x, by_p, by_q
    flow, ambient, kappa = plant.tube_area * velocity, plant.ambient_pressure, plant.heat_capacity_ratio
    start[X], start[U] = -flow / plant.chamber_volume, acceleration
    start[WORK], start[WORK + 1] = (p - ambient) * flow, -(q - ambient) * flow
    for chamber in range(2):
        row, sign = _GAS + chamber, 1.0 - 2.0 * chamber
        start[P + chamber], start[P + 2 + chamber] = 0.0, 0.0
        for i in range(8):
            w[row, i] = 0.0
        if plant.line:
            gas_rates = _gas(plant, motion, w, _TRIAL, chamber, flow)
            grows = -sign * plant.chamber_volume
            volume = gas_volume(plant, x if chamber == 0 else plant.total - x)
            start[P + chamber] = gas_rates[0]
            w[row, 0], w[row, 1] = gas_rates[2], grows * gas_rates[3]
            w[row, 2] = -sign * kappa * y[P + chamber] * plant.tube_area / volume
            if kappa > 1.0:
                start[P + 2 + chamber] = gas_rates[1]
                w[row, 3], w[row, 4], w[row, 5], w[row, 6] = (
                    gas_rates[4],
                    gas_rates[5],
                    grows * gas_rates[6],
                    gas_rates[7],
                )


@inlined
def _eliminate_gas(w: FloatArray, row: int, d: float, moves: float) -> float:
    """Prepare the two equations of a gas in (d - J) k = r. Returns: pressure change per velocity change."""
    free, by_velocity = d - w[row, 6], w[row, 2] - w[row, 1] * moves / d
    w[row, 7] = 1.0 / ((d - w[row, 0]) * free - w[row, 3] * w[row, 4])
    return float((by_velocity * free - w[row, 3] * w[row, 5] * moves / d) * w[row, 7])


@inlined
def _gas_increment(w: FloatArray, row: int, stage: int, column: int, d: float, x: float) -> float:
    """Change of a gas pressure without the part by the change of velocity."""
    pressure, content = w[stage, column] + w[row, 1] * x, w[stage, column + 2] + w[row, 5] * x
    return float((pressure * (d - w[row, 6]) + w[row, 3] * content) * w[row, 7])


@inlined
def _solve(
    plant: Record,
    motion: Record,
    w: FloatArray,
    stage: int,
    d: float,
    per_pivot: float,
    first: float,
    second: float,
) -> None:
    """Solve (d - J) k = r; the row of a stage holds r, then k.

    Fill and gases follow from the change of the velocity by their own rows, which leaves one equation.
    Args: `first`, `second`: results of `_eliminate_gas` for both gases.
    """
    y, moves, per = motion.state, _moves(plant, motion), 1.0 / d
    x = w[stage, X] * per
    p, q = _gas_increment(w, _GAS, stage, P, d, x), _gas_increment(w, _GAS + 1, stage, P + 1, d, x)
    change = w[stage, U] + w[_COLUMN, 1] * x + w[_COLUMN, 2] * p + w[_COLUMN, 3] * q
    change *= per_pivot
    x, p, q = x - moves * change * per, p + first * change, q + second * change
    if plant.heat_capacity_ratio > 1.0:
        for chamber in range(2):
            row, k = _GAS + chamber, p if chamber == 0 else q
            content = w[stage, P + 2 + chamber] + w[row, 5] * x + w[row, 4] * k
            w[stage, P + 2 + chamber] = content / (d - w[row, 6])
    w[stage, X], w[stage, U] = x, change if plant.inertia else 0.0
    w[stage, P], w[stage, P + 1] = p, q
    area, flow = moves * plant.chamber_volume, -w[_FIRST_RATE, X] * plant.chamber_volume
    ambient = plant.ambient_pressure
    w[stage, WORK] = (w[stage, WORK] + area * (y[P] - ambient) * change + flow * p) * per
    w[stage, WORK + 1] = (w[stage, WORK + 1] - area * (y[P + 1] - ambient) * change - flow * q) * per


@inlined
def _moves(plant: Record, motion: Record) -> float:
    """Fill ratio that leaves chamber 0 per metre of flow, 1/m; zero at rest."""
    return plant.tube_area / plant.chamber_volume if motion.direction != 0 else 0.0


@inlined
def _copy(w: FloatArray, row: int, to: int) -> None:
    for i in range(8):
        w[to, i] = w[row, i]


@inlined
def _stage_states(w: FloatArray, stage: int, y: FloatArray) -> None:
    """Set the states of a stage."""
    for i in range(8):
        w[_TRIAL, i] = y[i]
    for j in range(stage):
        for i in range(8):
            w[_TRIAL, i] += _A[stage, j] * w[j, i]


@inlined
def _add_earlier_stages(w: FloatArray, stage: int, per: float) -> None:
    """Add earlier stages to the right-hand side of a stage; `per`: one over the length of the step."""
    for j in range(stage):
        for i in range(8):
            w[stage, i] += _C[stage, j] * per * w[j, i]


@in_place
def _rosenbrock(plant: Record, motion: Record, h: float, w: FloatArray) -> float:
    """One step of length h into row `END`. Returns: error over the allowed one."""
    y, d = motion.state, 1.0 / (h * _GAMMA)
    moves = _moves(plant, motion)
    first, second = _eliminate_gas(w, _GAS, d, moves), _eliminate_gas(w, _GAS + 1, d, moves)
    pivot = (d - w[_COLUMN, 0] if plant.inertia else 1.0) + w[_COLUMN, 1] * moves / d
    per_pivot = 1.0 / (pivot - w[_COLUMN, 2] * first - w[_COLUMN, 3] * second)
    for stage in range(_STAGES):
        if stage == 0:
            _copy(w, _FIRST_RATE, 0)
        elif stage < _STAGES - 1:
            _stage_states(w, stage, y)
            _rates(plant, motion, w, _TRIAL, stage)
            _copy(w, stage, _STAGES - 1)
        _add_earlier_stages(w, stage, 1.0 / h)
        if not plant.inertia:
            w[stage, U] = 0.0
        _solve(plant, motion, w, stage, d, per_pivot, first, second)
    for i in range(8):
        w[END, i], w[_ERROR, i] = y[i], 0.0
        for j in range(_STAGES):
            w[END, i] += _B[j] * w[j, i]
            w[_ERROR, i] += _E[j] * w[j, i]
    if plant.line and plant.heat_capacity_ratio == 1.0:
        w[END, P + 2] = w[END, P] * gas_volume(plant, w[END, X]) / plant.temperature
        w[END, P + 3] = w[END, P + 1] * gas_volume(plant, plant.total - w[END, X]) / plant.temperature
    return _error(plant, y, w)


@in_place
def _error(plant: Record, y: FloatArray, w: FloatArray) -> float:
    """Largest error of a state over the allowed one; the works, integrals only, are not checked."""
    worst, supply = 0.0, plant.gas_pressure + plant.ambient_pressure
    for i in range(WORK):
        scale = 0.1 if i == X else _SLOW_M_S if i == U else 0.1 * (supply if i < P + 2 else y[i])
        error = abs(w[_ERROR, i]) / (plant.relative_error * (scale + abs(y[i])))
        worst = error if error > worst or math.isnan(error) else worst
    return worst


@inlined
def in_closed_form(plant: Record, motion: Record) -> bool:
    """True if isothermal gases alone change, each by one conductance, while the liquid rests."""
    still = motion.direction == 0 and not plant.leaks
    return bool(still and plant.line and plant.heat_capacity_ratio == 1.0)


@in_place
def take(plant: Record, motion: Record, left: float, w: FloatArray) -> float:
    """One accepted step that does not pass `left`, s, into row `END`. Returns: its length, s."""
    if in_closed_form(plant, motion):
        return _rest(plant, motion, left, w)
    _linearize(plant, motion, w)
    while True:
        motion.steps += 1
        h = min(motion.length, left)
        error = _rosenbrock(plant, motion, h, w)
        if not math.isfinite(error):
            error = 1e6
        done = error <= 1.0 or motion.steps >= plant.most_steps or h < _SHORTEST_STEP_S
        if not done or h < left or error > 0.1:
            factor = _GROW if error == 0.0 else _SAFETY / math.sqrt(math.sqrt(error))
            motion.length = h * min(max(factor, _SHRINK), _GROW)
        if done:
            return float(h)


@in_place
def _rest(plant: Record, motion: Record, left: float, w: FloatArray) -> float:
    """A step with the liquid at rest, in closed form.

    While both gases change their difference may have an extreme, so the step is then a short one.
    """
    y, h = motion.state, left
    if not (near_end(plant, motion, 0) or near_end(plant, motion, 1)):
        fastest = min(gas_volume(plant, y[X]), gas_volume(plant, plant.total - y[X]))
        h = min(left, _REST_STEP * fastest / plant.passing)
    motion.steps += 1
    rest_after(plant, motion, h, w, END)
    return float(h)


@in_place
def shorten(plant: Record, motion: Record, h: float, part: float, w: FloatArray) -> None:
    """End the step of length h just taken after a part of it, by the state `between` or a shorter step."""
    if (plant.inertia and motion.direction != 0) or in_closed_form(plant, motion):
        between(plant, motion, h, part, w)
        _copy(w, BETWEEN, END)
    else:
        _rosenbrock(plant, motion, h * part, w)


@in_place
def between(plant: Record, motion: Record, h: float, part: float, w: FloatArray) -> None:
    """State after a part of the step into row `BETWEEN`, cubic by the rates at both ends (row `_RATE`)."""
    if in_closed_form(plant, motion):
        rest_after(plant, motion, h * part, w, BETWEEN)
        return
    for i in range(8):
        rise = w[END, i] - motion.state[i]
        d0, d1 = h * w[_FIRST_RATE, i], h * w[_RATE, i]
        w[BETWEEN, i] = motion.state[i] + part * (
            d0 + part * (3.0 * rise - 2.0 * d0 - d1 + part * (d0 + d1 - 2.0 * rise))
        )


@in_place
def rates_at_end(plant: Record, motion: Record, w: FloatArray) -> None:
    """Rates at the end of a step, for `between`."""
    _rates(plant, motion, w, END, _RATE)


_STRAIGHT: Final = 1e-5
"""Argument below which tanh, tan and their inverses are linear to round-off."""
_flow_shape: Final = inlined(flow_shape)


@in_place
def rest_after(plant: Record, motion: Record, h: float, w: FloatArray, row: int) -> None:
    """State after a time with the liquid at rest, of isothermal gases, into a row."""
    for i in range(8):
        w[row, i] = motion.state[i]
    for chamber in range(2):
        p, is_open = w[row, P + chamber], motion.valve_0 > 0 if chamber == 0 else motion.valve_1 > 0
        volume = gas_volume(plant, w[row, X] if chamber == 0 else plant.total - w[row, X])
        time, end = h * plant.passing / volume, end_pressure(plant, is_open)
        if p < end:
            w[row, P + chamber] = end * _ratio_after(p / end, time, plant.critical_ratio, False)
        elif p > end:
            w[row, P + chamber] = end / _ratio_after(end / p, time, plant.critical_ratio, True)
        w[row, P + 2 + chamber] = w[row, P + chamber] * volume / plant.temperature


@in_place
def _ratio_after(ratio: float, time: float, critical_ratio: float, vents: bool) -> float:
    """Pressure ratio r, downstream over upstream, of a constant volume after a time in units of its tau.

    The gas keeps its temperature.  Filling, dr/dt = phi(r); venting, dr/dt = r phi(r); tau = V/(C p_0)
    sqrt(T_0/T), as in `physics.gas`, which has the times between two pressures.  Along the ellipse
    r = b + (1 - b) sin q with dq/dt = 1/(1 - b), or with y = tan(q/2) and c = 1 - b while venting
        dy/ds = (b y^2 + 2 c y + b)/2,  s = t/c,
    whose solution is a ratio of two linear functions of y(0).
    """
    b, r, left = critical_ratio, ratio, time
    if r < b:
        needed = math.log(b / r) if vents else b - r
        if left <= needed:
            return r * math.exp(left) if vents else r + left
        r, left = b, left - needed
    c, last = 1.0 - b, max(LAMINAR_RATIO, b)
    if r < last:
        ending = math.asin((last - b) / c)
        angle = math.asin((r - b) / c)
        if not vents:
            needed = c * (ending - angle)
            if left <= needed:
                return b + c * math.sin(angle + left / c)
        else:
            y, end = math.tan(angle / 2.0), math.tan(ending / 2.0)
            part = (end - y) / (c * y + b + end * (b * y + c))
            needed = c * _moebius_time(part, c * c - b * b)
            if left <= needed:
                part = _moebius_part(left / c, c * c - b * b)
                y = (y + part * (c * y + b)) / (1.0 - part * (b * y + c))
                return b + c * 2.0 * y / (1.0 + y * y)
        r, left = last, left - needed
    pace = _flow_shape(last, b) / (1.0 - last)
    rest = (1.0 - r) / (r if vents else 1.0) * math.exp(-min(left * pace, 700.0))
    return 1.0 / (1.0 + rest) if vents else 1.0 - rest


@in_place
def _moebius_part(time: float, square: float) -> float:
    """tanh(w s/2)/w with w^2 = `square`, which may be negative."""
    root = math.sqrt(abs(square))
    if root * time < _STRAIGHT:
        return time / 2.0
    return math.tanh(root * time / 2.0) / root if square > 0.0 else math.tan(root * time / 2.0) / root


@in_place
def _moebius_time(part: float, square: float) -> float:
    """Time s at which `_moebius_part` has a value."""
    root = math.sqrt(abs(square))
    if root * part < _STRAIGHT:
        return 2.0 * part
    return 2.0 * (math.atanh(root * part) if square > 0.0 else math.atan(root * part)) / root
