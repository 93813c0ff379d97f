"""The loop about the balanced state: the part of a small residual that one injection removes, and noise.

Gas for a time T into a chamber of fill x moves (S/V) u T of fill to the opposite one, so the vibration
changes by b T with b = kappa |dM/dx| (S/V) u, M the moment of the pair along x + x_opposite = const: that is
kappa lambda rho S u.  The controller commands T = Kc e along the residual, so a residual e becomes
e (1 - h exp(j d)) with h = Kc b and d the error of the assumed lag angle.  It shrinks for h < 2 cos d and
reverses from h = 1 / cos d on.  b differs between pairs, and between the two chambers of a pair.  A residual
that reverses is corrected by both chambers in turn, and (1 - h1)(1 - h2) <= (1 - (h1 + h2)/2)^2, so the mean
of both counts; of all pairs the largest.

`loop_information` gives all results on the loop that need no run.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.algorithm import Controller
from ringbalance.controller.algorithms.built_in import BuiltIn, TargetVector
from ringbalance.controller.algorithms.law_based import LawBased, controller_of, first_memory
from ringbalance.controller.algorithms.law_steps import (
    CHANGE,
    HIGHEST_CHANGE,
    LOWEST_CHANGE,
    change_of,
    split,
)
from ringbalance.controller.rotor import chamber_directions
from ringbalance.controller.terms import least_period, run_models
from ringbalance.controller.trials import Information
from ringbalance.physics.gas import applied_pressure
from ringbalance.reduced_model.crater import jet_text
from ringbalance.reduced_model.gas_line import line_document, line_text
from ringbalance.reduced_model.injection.dynamics import empty_plants
from ringbalance.reduced_model.injection.line_answers import line_answers
from ringbalance.reduced_model.injection.moment import fill_for_moment, tabulate_moment
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio, stalled_fill_ratio
from ringbalance.reduced_model.terms import neglected_in_injections
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import FloatArray, finite
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.models import Scene
from ringbalance.scene.units import parse_quantity

_FILL_STEP: Final = 1e-4
"""Half the distance over which the slope of a moment is taken, as a fraction of the range of fills."""
_DEVIATIONS: Final = 3.0
_NEAR_ONE: Final = 0.1
"""Distance from one within which factors have a fourth digit."""
_SMALL_GAIN_MARGIN: Final = 1.1
"""Gain margin below which a loop is near instability: rotor and flow are seldom known more closely."""
_TAKEN_BY_LAG: Final = 1.0 / _SMALL_GAIN_MARGIN
"""Part cos(d) of the gain margin, below which the lag angle has taken a notable part of it."""
_SMALL_PHASE_MARGIN_RAD: Final = math.radians(10.0)
"""Phase margin likewise: about three times the half-width with which a lag angle is measured."""
_INTEGRAL_LAG_RAD: Final = math.pi / 4.0
"""Error of the lag angle from which on a loop with an integral part is unstable at any gain."""
_LEAST_INTEGRAL_STEPS: Final = 5.0
"""Integral time, in sampling intervals, below which the margins may not hold, see `loop_margins`."""


@dataclass(frozen=True, kw_only=True)
class LoopFactor:
    """The loop of one controller about the balanced state."""

    rate: float
    """b, change of the vibration per valve-open time, m/s; zero where nothing flows."""
    value: float | None
    """h, part of a small residual that one injection removes; None for an algorithm without a gain."""
    fixed: bool
    """True if h keeps its value; an algorithm that learns approaches one."""
    limit: float
    """2 cos d, from which a small residual grows."""
    margins: Margins | None
    """None for an algorithm without a gain, or where nothing flows."""
    deviation: float | None
    """Stationary standard deviation of the amplitude under the sensor's noise, m; None: it has none."""

    @property
    def unstable(self) -> bool:
        """True if a small residual grows."""
        return self.fixed and self.value is not None and self.value >= self.limit


def loop_factor(scene: Scene, model: BalancerModel, controller: Controller[Any] | BuiltIn) -> LoopFactor:
    """The loop of a scene under a law and a controller.

    The law-based algorithm removes kappa/kappa' of a residual, kappa' its assumed influence coefficient, and
    learns the true one: what noise leaves is taken at a loop factor of one.  A trial has no linear loop, and
    the same bound on the noise is used for it.
    """
    rate, sensor = loop_rate(scene, model), scene.sensor
    # Standard deviation of the measured vibration at an amplitude equal to the limit, m.
    noise = math.hypot(sensor.amplitude_noise, scene.controller.limit * sensor.phase_noise)
    value: float | None = None
    error = integral = derivative = 0.0
    settings = scene.controller
    if isinstance(controller, TargetVector):
        value = settings.proportional * rate
        error = settings.assumed_lag_angle - scene.rotor.lag_angle
        integral = settings.period / (settings.integral_time or math.inf)
        derivative = settings.derivative_time / settings.period
    if isinstance(controller, LawBased):
        value = scene.rotor.influence_coefficient / abs(settings.assumed_influence)
    # The law-based algorithm approaches a loop factor of one.
    fixed = isinstance(controller, TargetVector)
    deviation = _stationary_deviation(
        loop_factor=value if fixed and value is not None else 1.0,
        noise=noise,
        integral=integral,
        derivative=derivative,
        lag_error=error,
    )
    margins = None
    if value is not None and rate != 0.0:
        margins = loop_margins(cmath.rect(value, error) if fixed else 1.0, integral=integral > 0.0)
    return LoopFactor(
        rate=rate,
        value=value,
        margins=margins,
        fixed=fixed,
        limit=2.0 * max(math.cos(error), 0.0),
        deviation=None if value is None else deviation,
    )


def default_gain(scene: Scene) -> Iterator[Finding]:
    """Finding that a loop is judged by the default gain, as its scene gives none and no search chose one."""
    key = LIQUID_RING.tables["controller"].keys["proportional"]
    as_default = scene.controller.proportional == parse_quantity(key.presence.default, "gain")
    if as_default and scene.origin_of("controller.proportional") == "default":
        yield Finding(code="default_gain", values={"proportional": scene.controller.proportional})


def short_period(scene: Scene, model: BalancerModel) -> Iterator[Finding]:
    """Finding that the next sample is taken before an injection is over."""
    period, least = scene.controller.period, least_period(scene, model)
    if period < least:
        yield Finding(code="period_too_short", values={"period": period, "least": least})


def sampling_interval(scene: Scene) -> float:
    """Sampling interval of a correction at the limit, s: `period`, the valve's offset and Kc times the limit.

    With a larger correction the interval, and the integral's part of it, is longer by the valve-open time.
    """
    settings = scene.controller
    offset = max(settings.offsets(scene.disc.chambers))
    return settings.period + offset + settings.proportional * settings.limit


def small_margin(scene: Scene, margins: Margins | None) -> Iterator[Finding]:
    """Findings that a loop is near instability or beyond it: by its gain, lag angle or derivative.

    The error d of the lag angle leaves the part cos(d) of the gain margin 2 cos(d)/h.  The derivative answers
    a rise r of the readings, be it noise, with h q r, q = Td/dt: from h q = 1 on with more than the rise.
    Where a correction reverses the residual, y' = h (1 + q) y - h q y_before - y, and rises grow without end
    from sqrt(h q) = 1 + sqrt(2 - h) on, where both roots are real and above one.
    """
    settings = scene.controller
    if margins is None or settings.kind != "target_vector":
        return
    error = abs(math.remainder(settings.assumed_lag_angle - scene.rotor.lag_angle, math.tau))
    notable, highest = math.cos(error) < _TAKEN_BY_LAG, settings.proportional * margins.gain_factor
    if not margins.stable:
        if notable:
            yield Finding(code="lag_beyond", values={"error": error})
        if error < _INTEGRAL_LAG_RAD:
            limit = 2.0 * math.cos(error)
            loop: dict[str, Value] = {"loop_factor": limit / margins.gain_factor, "loop_factor_limit": limit}
            gains: dict[str, Value] = {"proportional": highest, "half": highest / 2.0}
            yield Finding(code="gain_too_high", values=loop | gains)
        return
    if margins.gain_factor < _SMALL_GAIN_MARGIN and not notable:
        values: dict[str, Value] = {"factor": margins.gain_factor, "half": highest / 2.0}
        yield Finding(code="gain_margin_small", values=values)
    elif margins.phase < _SMALL_PHASE_MARGIN_RAD:
        yield Finding(code="phase_margin_small", values={"phase": margins.phase, "error": error})
    interval, loop_factor = sampling_interval(scene), 2.0 * math.cos(error) / margins.gain_factor
    intervals = settings.derivative_time / interval
    if (answer := loop_factor * intervals) >= 1.0:
        values = {"intervals": intervals, "answer": answer, "highest": interval / loop_factor}
        yield Finding(code="derivative_noise", values=values)


def short_integral(scene: Scene) -> Iterator[Finding]:
    """Finding that margins do not cover the integral of the target-vector controller."""
    time = scene.controller.integral_time
    if scene.controller.kind == "target_vector" and time is not None:
        intervals = time / sampling_interval(scene)
        if intervals < _LEAST_INTEGRAL_STEPS:
            yield Finding(code="integral_short", values={"intervals": intervals})


def vibration_left(scene: Scene, loop: LoopFactor) -> float | None:
    """Largest vibration that remains, m: three standard deviations under noise or, if larger, half a step of
    the shortest injection on each of two pairs; None for an unstable loop.
    """
    noise = loop.deviation or 0.0
    step = scene.controller.minimum_gas_time * loop.rate
    return max(_DEVIATIONS * noise, step / math.sqrt(2.0)) if math.isfinite(noise) else None


def _balanced_fills(scene: Scene, model: BalancerModel) -> FloatArray:
    """Fills of the positive chambers with which the disc cancels the unbalance, or comes nearest to it."""
    start, law = scene.disc.initial_fill, model.flow
    total = 2.0 * start
    least, most = _range(scene, model)
    # A chamber is driven to its residual fill, or to that at which the gas stalls.
    stalled = stalled_fill_ratio(law=law, total=total, gas_pressure=applied_pressure(scene.gas))
    lowest = max(least, min(max(residual_fill_ratio(scene, law=law), stalled), start))
    highest = min(most, total - lowest)
    ends = np.array([start, lowest, highest])
    now, low, high = model.moment.pair_moment(fill_ratio=ends, opposite_fill_ratio=total - ends)
    pairs = scene.disc.chambers // 2
    row = first_memory(chamber_directions(scene.disc.chambers)[:pairs]).tolist()
    changes = [change_of(0, pair) for pair in range(pairs)]
    for at in changes:
        row[at + LOWEST_CHANGE], row[at + HIGHEST_CHANGE] = float(low - now), float(high - now)
    unbalance = scene.rotor_as_read.initial_unbalance
    split(row, 0, pairs, -unbalance.real, -unbalance.imag)
    plant = empty_plants(1)[0]
    tabulate_moment(plant, model, total=total)
    fills = [fill_for_moment(plant, float(now) + row[at + CHANGE], lowest, highest) for at in changes]
    return np.asarray(np.clip(np.array(fills), lowest, highest), dtype=np.float64)


def loop_rate(scene: Scene, model: BalancerModel) -> float:
    """b of the fastest pair, the mean of its two chambers, m/s."""
    return float(np.max(np.mean(vibration_rates(scene, model), axis=1)))


def vibration_rates(scene: Scene, model: BalancerModel) -> FloatArray:
    """b at the balanced fills, m/s, shape (pairs, 2): gas into the positive chamber, into the other one."""
    total, (lowest, highest) = 2.0 * scene.disc.initial_fill, _range(scene, model)
    fills = _balanced_fills(scene, model)
    step = _FILL_STEP * (highest - lowest)
    after, before = np.minimum(fills + step, highest), np.maximum(fills - step, lowest)
    up, down = (
        model.moment.pair_moment(fill_ratio=x, opposite_fill_ratio=total - x) for x in (after, before)
    )
    slope = np.abs(up - down) / (after - before)
    driven = np.stack([fills, total - fills], axis=-1)
    opposite = np.clip(total - driven, lowest, highest)
    # An injection starts with the content that the tube holds while the gas is off.
    rest = model.flow.evaluate(fill_ratio=driven, opposite_fill_ratio=opposite, gas_pressure=0.0, primed=True)
    flow = model.flow.evaluate(
        fill_ratio=driven,
        opposite_fill_ratio=opposite,
        gas_pressure=applied_pressure(scene.gas),
        primed=rest.primed,
    )
    per_fill = scene.rotor.influence_coefficient * model.tube_area / model.chamber_volume
    return np.asarray(per_fill * slope[:, None] * np.maximum(flow.velocity, 0.0))


def _range(scene: Scene, model: BalancerModel) -> tuple[float, float]:
    total, largest = 2.0 * scene.disc.initial_fill, model.flow.max_fill_ratio
    return max(0.0, total - largest), min(total, largest)


def _stationary_deviation(
    *,
    loop_factor: float,
    noise: float,
    integral: float = 0.0,
    derivative: float = 0.0,
    lag_error: float = 0.0,
) -> float:
    """Standard deviation of the residual that sensor noise sustains in the sampled loop.

    With the measured m = x + n, i = dt/Ti (`integral`) and q = Td/dt (`derivative`) a step is
    w' = w + i (m + m_before)/2,  x' = x - h exp(j d) (m + w' + q (m - m_before)).
    If the residual reverses at every sample (h cos d > 1), the integral is reset each time, and since an
    amplitude has no sign, the law with i = 0 reads in y = (-1)^k x
    y' = h exp(j d) (m + q (m - m_before)) - y.
    With P alone both give noise sqrt(h/(2 cos d - h)).  An amplitude within the limit rests, and the first
    step after it is P alone.
    Returns: The unit of `noise`; infinite for an unstable loop.
    """
    h, turns = cmath.rect(loop_factor, lag_error), loop_factor * math.cos(lag_error) > 1.0
    i, sign = (0.0, -1.0) if turns else (integral, 1.0)
    now, before = 1.0 + i / 2.0 + derivative, i / 2.0 - derivative
    step = np.array(
        [[sign * (1.0 - h * now), -sign * h * before, -sign * h], [1.0, 0.0, 0.0], [i / 2.0, i / 2.0, 1.0]],
        dtype=np.complex128,
    )
    push = np.array([[-sign * h * now], [1.0], [i / 2.0]], dtype=np.complex128)
    if i == 0.0:
        step, push = step[:2, :2], push[:2]
    if np.max(np.abs(np.linalg.eigvals(step))) >= 1.0:
        return math.inf
    if noise == 0.0:
        return 0.0
    # P = A P A^H + B B^H, row by row.
    size = step.shape[0]
    equations = np.eye(size**2) - np.kron(step, step.conj())
    variance = np.linalg.solve(equations, (push @ push.conj().T).ravel())[0]
    return noise * math.sqrt(max(float(variance.real), 0.0))


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Margins of the loop of small residuals; those of the disk are of its proportional part alone."""

    gain_factor: float
    """Factor by which the loop factor may grow, with the present error of the lag angle."""
    phase: float
    """Further error of the lag angle that the loop tolerates, rad."""
    disk: float
    """Disk margin, 0 to 2: gain and phase may change together, differently at each frequency."""
    disk_gain_factor: float
    """Factor by which the gain may then grow or fall, (2 + disk)/(2 - disk)."""
    disk_phase: float
    """Angle by which the phase may then turn, 2 atan(disk/2), rad."""
    sensitivity_peak: float
    """Largest gain from a disturbance of the vibration to the vibration, max |1/(1 + L)|."""

    @property
    def stable(self) -> bool:
        """True if a small residual decays."""
        return self.gain_factor > 1.0 and self.phase > 0.0


def loop_margins(gain: complex, *, integral: bool = False) -> Margins:
    """Margins of a loop with g = h exp(j d), d the error of the lag angle: 2 cos(d)/h and acos(h/2) - |d|.

    They hold with integral and derivative part too, which act on the amplitude.  At the edge the amplitude
    is constant, so that the derivative is zero, and the residual turns by 180 deg - 2 |d| from sample to
    sample, which resets the integral while that is more than 90 deg: with an integral part, however small,
    |d| stays below 45 deg.  Noise-free runs lose stability within 4 % of that h (P, I, D, |d| to 30 deg, Td
    to 0.4, Ti from five sampling intervals on), and with an integral between 42 and 52 deg.

    Disk margin and peak have the exact L(z) = g/(z - 1) of the proportional part: |2 (1 + L)/(1 - L)| and
    |1/(1 + L)| on the unit circle lie on circles, 2 (2 - h)/(2 + h) and 2/(2 - h) for real g.
    Source: Seiler, Packard and Gahinet, "An Introduction to Disk Margins", IEEE Control Systems Magazine 40
        (2020), with the balanced sensitivity (S - T)/2; ISO 14839-3:2006 for the peak.
    """
    h, error = abs(gain), abs(cmath.phase(gain))
    most = math.acos(min(h / 2.0, 1.0))
    if integral:
        most = min(most, _INTEGRAL_LAG_RAD)
    phase = max(most - error, 0.0)
    disk, peak = 0.0, math.inf
    if phase > 0.0:
        centre, radius = _image(1.0 - gain, 1.0 + gain)
        disk = min(2.0 * abs(abs(centre) - radius), 2.0)
        centre, radius = _image(1.0, 1.0 - gain)
        peak = abs(centre) + radius
    return Margins(
        gain_factor=0.0 if integral and error >= _INTEGRAL_LAG_RAD else max(2.0 * math.cos(error), 0.0) / h,
        phase=phase,
        disk=disk,
        disk_gain_factor=math.inf if disk >= 2.0 else (2.0 + disk) / (2.0 - disk),
        disk_phase=2.0 * math.atan(disk / 2.0),
        sensitivity_peak=peak,
    )


def _image(a: complex, b: complex) -> tuple[complex, float]:
    """Centre and radius of the circle to which (z - a)/(z - b) maps the unit circle, |b| not 1."""
    inside = 1.0 - abs(b) ** 2
    return 1.0 + (b - a) * complex(b).conjugate() / inside, abs(b - a) / abs(inside)


def loop_information(scene: Scene, model: BalancerModel) -> Information:
    """Loop factor and margins of the linear loop about the balanced state, with gas line and models."""
    loop, settings = loop_factor(scene, model, controller_of(scene, model)), scene.controller
    used, lines = run_models(scene=scene, model=model), line_answers(scene, model)
    margins, neglected = loop.margins, neglected_in_injections(used)
    document: dict[str, Any] = {
        "law": model.name,
        "controller": settings.kind,
        "gain": settings.proportional if settings.kind == "target_vector" else None,
        "loop_factor": loop.value,
        "loop_factor_limit": loop.limit,
        "vibration_rate_m_per_s": loop.rate,
        "stationary_deviation_m": finite(loop.deviation),
        "vibration_left_m": vibration_left(scene, loop),
        "margins": margins and {name: finite(value) for name, value in asdict(margins).items()},
        "gas_time_offset_s": list(settings.offsets(scene.disc.chambers)),
        "limit_m": settings.limit,
        "gas_line": line_document(lines),
        "left_out": [],
        "neglected": asdict(neglected),
        "models_used": [asdict(each) for each in used],
    }
    return Information(
        quantities=tuple(_quantities(scene, loop, margins)),
        facts=[
            ("flow law", model.name),
            ("algorithm", settings.kind.replace("_", " ")),
            ("gas line", line_text(lines)),
            ("neglected", neglected.text),
            ("gas jet", jet_text(scene)),
        ],
        document=document,
        findings=(*small_margin(scene, margins), *short_integral(scene)),
    )


def _quantities(scene: Scene, loop: LoopFactor, margins: Margins | None) -> Iterator[Quantity]:
    rows: list[tuple[str, str, str, float | None]] = [
        ("loop_factor", "loop factor", "1", loop.value),
        ("loop_factor_limit", "loop factor from which a residual grows", "1", loop.limit),
        ("stationary_deviation", "standard deviation that noise leaves", "m", finite(loop.deviation)),
    ]
    if (left := vibration_left(scene, loop)) is not None:
        left /= scene.rotor.influence_coefficient
        rows.append(("unbalance_left", "unbalance that noise leaves at most", "kg m", left))
    if margins is not None:
        rows += [
            ("gain_margin", "gain margin, factor", "1", finite(margins.gain_factor)),
            ("phase_margin", "phase margin", "rad", margins.phase),
            ("disk_gain_margin", "disk margin of P alone, factor", "1", finite(margins.disk_gain_factor)),
            ("disk_phase_margin", "disk margin of P alone, phase", "rad", margins.disk_phase),
        ]
    for key, name, unit, value in rows:
        if value is not None:
            digits = 4 if unit == "1" and abs(value - 1.0) < _NEAR_ONE else 3
            yield Quantity(key=key, name=name, unit=unit, value=value, digits=digits)
