"""One step in time of a pair's states by a linearly implicit method, for easy and stiff flows alike.

A very viscous liquid in a narrow tube answers in microseconds while the levels shift for minutes, and a gas
line is stiff towards the end of filling; an explicit method would creep there.
Source: RODAS, order 4(3), L-stable: Hairer and Wanner, "Solving Ordinary Differential Equations II" (1996),
section IV.7.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.formulas.gas_flow import flow_shape
from ringbalance.controller.liquid_ring.compiled_column import accelerations, ends, steady
from ringbalance.controller.liquid_ring.records import WORK, P, Record, U, X
from ringbalance.scene.arrays import FloatArray

_STAGES: Final = 6
_GAMMA: Final = 0.25
_A: Final = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [1.544, 0.0, 0.0, 0.0],
        [0.9466785280815826, 0.2557011698983284, 0.0, 0.0],
        [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0],
        [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950],
    ]
)
"""Weights of earlier stages in the states of a stage; the sixth stage adds the fifth to its states."""
_C: Final = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0],
        [-5.6688, 0.0, 0.0, 0.0, 0.0],
        [-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0],
        [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0],
        [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0.0],
        [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
    ]
)
"""Weights of earlier stages, over the length of the step, in the right-hand side of a stage."""
_DIFFERENCE: Final = 1e-8
"""Relative, of a state, for a column of the Jacobian."""
_LEAST_GAS: Final = 1e-3
"""Fraction of a chamber that liquid never takes from its gas."""
_SHORTEST_STEP: Final = 1e-15
"""s, below which no error is looked at."""
_SAFETY: Final = 0.9
_SHRINK: Final = 0.2
_GROW: Final = 5.0
# Rows of the workspace: stages, then these, then the matrix.
_TRIAL: Final = 6
_RATE: Final = 7
END: Final = 8
"""Row of the workspace that holds the state at the end of a step."""
BETWEEN: Final = 9
"""Row that holds a state within a step."""
_FIRST_RATE: Final = 10
_JACOBIAN: Final = 11
_MATRIX: Final = 17

_flow_shape: Final = compiled(flow_shape)


@compiled
def gas_volume(plant: Record, x: float) -> float:
    """Volume of the gas that belongs to a chamber of fill x: (1 - x) V and the dead volume, m^3."""
    return float(max(1.0 - x, _LEAST_GAS) * plant.chamber_volume + plant.dead_volume)


@compiled
def line_rates(
    plant: Record, pressure: float, content: float, volume: float, growth: float, is_open: bool
) -> tuple[float, float]:
    """dp/dt (Pa/s) and d(m R)/dt (W/K) of a chamber's gas that fills from the supply or vents.

    `content` is m R = p V/T, J/K; `growth` is dV/dt.
    Source: ISO 6358-1 for the mass flow, as in `physics.gas.supply`; first law for the chamber's gas.
    """
    outside = plant.ambient_pressure + (plant.gas_pressure if is_open else 0.0)
    temperature, sign, up, down = plant.temperature, 1.0, outside, pressure
    if outside < pressure:
        sign, up, down = -1.0, pressure, outside
        if plant.heat_capacity_ratio > 1.0:
            # A trial step may empty a chamber of its gas; such a step is thrown away.
            temperature = pressure * volume / max(content, 1e-9 * volume)
    shape = _flow_shape(down / up, plant.critical_ratio)
    flow = sign * plant.passing * math.sqrt(temperature) * up * shape
    return plant.heat_capacity_ratio * (flow - pressure * growth) / volume, flow / temperature


@compiled
def _rates(plant: Record, motion: Record, y: FloatArray, out: FloatArray) -> None:
    """Rates of all states with the liquid at rest, or moving in one direction."""
    x, p, q, direction = y[X], y[P], y[P + 1], motion.direction
    opposite, ambient, primed = plant.total - x, plant.ambient_pressure, motion.primed > 0
    speed, acceleration = 0.0, 0.0
    if direction != 0 and plant.inertia:
        speed = max(y[U] * direction, 0.0)
        at = ends(plant, x, opposite, p - ambient, q - ambient, direction)
        full, broken = accelerations(plant, at, speed, direction, primed, motion.log_speed)
        acceleration = min(full, broken) * direction
    elif direction != 0:
        found = steady(plant, x, opposite, p - ambient, q - ambient, primed, motion.log_speed)
        speed = max(found[0] * direction, 0.0)
    flow = plant.tube_area * speed * direction
    out[X], out[U] = -flow / plant.chamber_volume, acceleration
    out[P], out[P + 1], out[P + 2], out[P + 3] = 0.0, 0.0, 0.0, 0.0
    if plant.line:
        first, second = gas_volume(plant, x), gas_volume(plant, opposite)
        out[P], out[P + 2] = line_rates(plant, p, y[P + 2], first, flow, motion.valve_0 > 0)
        out[P + 1], out[P + 3] = line_rates(plant, q, y[P + 3], second, -flow, motion.valve_1 > 0)
    out[WORK], out[WORK + 1] = (p - ambient) * flow, -(q - ambient) * flow


@compiled
def _active(plant: Record) -> int:
    """States that the rates depend on: fill and velocity, pressures with a line, contents if adiabatic."""
    if not plant.line:
        return 2
    return 6 if plant.heat_capacity_ratio > 1.0 else 4


@compiled
def _linearize(plant: Record, motion: Record, w: FloatArray) -> None:
    """Jacobian by differences, column j in row `_JACOBIAN` + j, and the rates themselves."""
    y, trial, base = motion.state, w[_TRIAL], w[_FIRST_RATE]
    _rates(plant, motion, y, base)
    for j in range(_active(plant)):
        column = w[_JACOBIAN + j]
        if (motion.direction == 0 and j <= U) or (j == U and not plant.inertia):
            column[:] = 0.0
            continue
        trial[:] = y
        scale = 1.0 if j <= U else plant.ambient_pressure if j < P + 2 else abs(y[j])
        change = _DIFFERENCE * max(abs(y[j]), 0.1 * scale)
        # Along the flow: against it a column at rest would not move.
        trial[j] += change * (motion.direction if j == U else 1)
        change = trial[j] - y[j]
        _rates(plant, motion, trial, column)
        for i in range(8):
            column[i] = (column[i] - base[i]) / change


@compiled
def _eliminate(n: int, diagonal: float, w: FloatArray) -> None:
    """Triangular factors of diagonal - J for the first n states; small steps make the diagonal dominate."""
    for i in range(n):
        for j in range(n):
            w[_MATRIX + i, j] = (diagonal if i == j else 0.0) - w[_JACOBIAN + j, i]
    for k in range(n):
        for i in range(k + 1, n):
            factor = w[_MATRIX + i, k] / w[_MATRIX + k, k]
            w[_MATRIX + i, k] = factor
            for j in range(k + 1, n):
                w[_MATRIX + i, j] -= factor * w[_MATRIX + k, j]


@compiled
def _solve(n: int, diagonal: float, w: FloatArray, k: FloatArray) -> None:
    """Solve (diagonal - J) k = k; beyond the first n states J has these columns alone."""
    for i in range(n):
        for j in range(i):
            k[i] -= w[_MATRIX + i, j] * k[j]
    for back in range(n):
        i = n - 1 - back
        for j in range(i + 1, n):
            k[i] -= w[_MATRIX + i, j] * k[j]
        k[i] /= w[_MATRIX + i, i]
    for i in range(n, 8):
        for j in range(n):
            k[i] += w[_JACOBIAN + j, i] * k[j]
        k[i] /= diagonal


@compiled
def _rosenbrock(plant: Record, motion: Record, h: float, w: FloatArray) -> float:
    """One step of length h into row `END`. Returns: error over the allowed one."""
    n, y, trial, rate = _active(plant), motion.state, w[_TRIAL], w[_RATE]
    diagonal = 1.0 / (h * _GAMMA)
    _eliminate(n, diagonal, w)
    for stage in range(_STAGES):
        if stage < 5:
            for i in range(8):
                trial[i] = y[i]
                for j in range(min(stage, 4)):
                    trial[i] += _A[stage, j] * w[j, i]
        else:
            for i in range(8):
                trial[i] += w[4, i]
        if stage == 0:
            rate[:] = w[_FIRST_RATE]
        else:
            _rates(plant, motion, trial, rate)
        for i in range(8):
            w[stage, i] = rate[i]
            for j in range(stage):
                w[stage, i] += _C[stage, j] / h * w[j, i]
        _solve(n, diagonal, w, w[stage])
    for i in range(8):
        w[END, i] = trial[i] + w[5, i]
    return _error(plant, y, w[5])


@compiled
def _error(plant: Record, y: FloatArray, estimate: FloatArray) -> float:
    """Largest error of a state over the allowed one; the works are integrals and allow any."""
    worst, part, supply = 0.0, 0.1 * plant.relative_error, plant.gas_pressure + plant.ambient_pressure
    for i in range(WORK):
        scale = part * (1.0 if i == X else 100.0 if i == U else supply if i < P + 2 else y[i])
        error = abs(estimate[i]) / (scale + plant.relative_error * abs(y[i]))
        worst = error if error > worst or math.isnan(error) else worst
    return worst


@compiled
def take(plant: Record, motion: Record, left: float, w: FloatArray) -> float:
    """One accepted step that does not pass `left`, s, into row `END`. Returns: its length, s."""
    _linearize(plant, motion, w)
    while True:
        motion.steps += 1
        h = min(motion.length, left)
        error = _rosenbrock(plant, motion, h, w)
        if not math.isfinite(error):
            error = 1e6
        done = error <= 1.0 or motion.steps >= plant.most_steps or h < _SHORTEST_STEP
        if not done or h < left or error > 0.1:
            factor = _GROW if error == 0.0 else _SAFETY * error**-0.25
            motion.length = h * min(max(factor, _SHRINK), _GROW)
        if done:
            return float(h)


@compiled
def shorten(plant: Record, motion: Record, h: float, w: FloatArray) -> None:
    """The step just taken again, with another length."""
    _rosenbrock(plant, motion, h, w)


@compiled
def between(motion: Record, h: float, part: float, w: FloatArray) -> None:
    """State after a part of the step into row `BETWEEN`, cubic by the rates at both ends (row `_RATE`)."""
    for i in range(WORK):
        rise = w[END, i] - motion.state[i]
        d0, d1 = h * w[_FIRST_RATE, i], h * w[_RATE, i]
        w[BETWEEN, i] = motion.state[i] + part * (
            d0 + part * (3.0 * rise - 2.0 * d0 - d1 + part * (d0 + d1 - 2.0 * rise))
        )


@compiled
def rates_at_end(plant: Record, motion: Record, w: FloatArray) -> None:
    """Rates at the end of a step, for `between`."""
    _rates(plant, motion, w[END], w[_RATE])
