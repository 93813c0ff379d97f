"""Many closed-loop runs of the target-vector algorithm, each as `simulate` does one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from ringbalance.controller.algorithms.by_name import target_vector_of
from ringbalance.controller.ensemble.compiled_noise import noise_key
from ringbalance.controller.ensemble.compiled_records import GAS_LINE, MOMENT_NODES, RUN, SHARED
from ringbalance.controller.ensemble.compiled_sample import run_members
from ringbalance.controller.ensemble.samples import LARGEST_RATIO, Members
from ringbalance.controller.formulas import piece_rise
from ringbalance.controller.liquid_ring.motion import Dynamics
from ringbalance.controller.liquid_ring.plant import floods
from ringbalance.controller.liquid_ring.records import MOTION, WORKSPACE
from ringbalance.controller.loop import GAS_POINTS, IDLE_OPERATIONS, TAIL_POINTS
from ringbalance.controller.rotor import chamber_directions
from ringbalance.controller.simulation import noise_floor
from ringbalance.controller.tuning.loop_factor import LoopFactor, loop_factor
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.operating.residual import Drawing
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Scene


class MomentTable(NamedTuple):
    """Moment of a pair over the fill of its positive chamber, cubic between equally spaced nodes."""

    lowest: float
    """Smallest x."""
    step: float
    """Distance of the nodes."""
    value: ComplexArray
    """Along the pair's axis and across it, kg m, shape (n,)."""
    slope: ComplexArray
    """kg m per step, shape (n,)."""

    def at(self, fill: FloatArray) -> ComplexArray:
        """Moment of the pair, kg m, for fills of the positive chamber."""
        place = np.clip((fill - self.lowest) / self.step, 0.0, self.value.size - 1.0)
        cell = np.minimum(place.astype(np.intp), self.value.size - 2)
        t = place - cell
        y0, d0 = self.value[cell], self.slope[cell]
        rise, d1 = self.value[cell + 1] - y0, self.slope[cell + 1]
        return np.asarray(y0 + piece_rise(t, rise, d0, d1))

    @classmethod
    def of(cls, *, model: BalancerModel, total: float) -> MomentTable:
        """Tabulate a balancer's moment of a pair whose two fill ratios sum to `total`."""
        largest = model.flow.max_fill_ratio
        lowest, highest = max(0.0, total - largest), min(total, largest)
        step = (highest - lowest) / (MOMENT_NODES - 1)

        def of(x: FloatArray) -> ComplexArray:
            held = np.clip(x, lowest, highest)
            return model.moment.pair_vector(fill_ratio=held, opposite_fill_ratio=total - held)

        x = np.linspace(lowest, highest, MOMENT_NODES)
        before, after = np.maximum(x - step / 2, lowest), np.minimum(x + step / 2, highest)
        slope = (of(after) - of(before)) / (after - before) * step
        return cls(lowest=float(lowest), step=float(step), value=of(x), slope=slope)


NOTES: Final = GAS_POINTS + 1 + TAIL_POINTS
"""Instants of an injection and its wait, with the earlier closing of two valves."""
RELATIVE_ERROR: Final = 1e-4
"""Allowed to one step of a member's states: an injection then ends within 1e-6 in fill of a single run's, and
within 3e-5 without inertia."""
MOST_SAMPLES: Final = 100_000
"""Of one compiled run, which costs a thousandth of an interpreted one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MemberRuns:
    """How each member's run ended; arrays of one length."""

    settled: BoolArray
    settling_time: FloatArray
    """s; infinite when not settled."""
    overshoots: IntArray
    misadjustments: IntArray
    diverged: BoolArray
    drifted: BoolArray
    """Not settled, and liquid ran back with the gas off."""
    shortened: IntArray
    """Injections shortened or left out to keep the residual fill."""
    samples: IntArray
    final_amplitude: FloatArray
    """m."""


@dataclass(frozen=True, kw_only=True, eq=False)
class EnsemblePlan:
    """What all members of an ensemble share, ready for compiled code."""

    shared: npt.NDArray[np.void]
    """Type `SHARED`, shape (1,)."""
    plant: npt.NDArray[np.void]
    """Type `PLANT`, shape (1,)."""
    loop: LoopFactor
    """Of a member with the scene's own values."""
    rotor: Rotor
    drawing: Drawing
    """From which the residual fill of each member follows."""

    def run(self, members: Members, *, seed: int, number: int = 0) -> MemberRuns:
        """Run some members; `number`, of the first of them in the ensemble, identifies its noise."""
        gain = members.moment_factor * members.influence_coefficient * np.exp(-1j * members.lag_angle)
        runs = np.zeros(members.proportional.size, dtype=RUN)
        runs["number"] = number + np.arange(runs.size)
        runs["speed"], runs["proportional"] = members.velocity_factor, members.proportional
        runs["gain_real"], runs["gain_imaginary"] = gain.real, gain.imag
        runs["residual_fill"] = members.residual_fill(self.drawing)
        runs["stays"] = self._stay(members)
        shared = self.shared.copy()
        shared["key_0"], shared["key_1"] = noise_key(seed=seed)
        half = int(shared["chambers"][0]) // 2
        motions = np.zeros(2 * half + 1, dtype=MOTION)
        plant, notes = self.plant.copy(), np.zeros((half + 1, NOTES))
        runs["gas_line"] = self._gas_lines(members)
        run_members(shared[0], plant[0], runs, motions, notes, np.zeros(WORKSPACE))
        return MemberRuns(
            settled=runs["settled"] > 0,
            settling_time=runs["settling_time"],
            overshoots=runs["overshoots"],
            misadjustments=runs["misadjustments"],
            diverged=runs["diverged"] > 0,
            drifted=runs["drifted"] > 0,
            shortened=runs["shortened"],
            samples=runs["samples"],
            final_amplitude=runs["amplitude"],
        )

    def _gas_lines(self, members: Members) -> FloatArray:
        """`GAS_LINE` of each member; the critical ratio stays below one."""
        own = np.array([float(self.plant[name][0]) for name in GAS_LINE])
        factors = np.ones((own.size, 1)) if members.gas_line is None else members.gas_line
        lines = own * factors.T
        lines[:, 1] = np.minimum(lines[:, 1], LARGEST_RATIO)
        return lines

    def _stay(self, members: Members) -> BoolArray:
        """Whether each member's loop is expected to stay within the limit, as `LoopFactor.stays`."""
        nominal = self.rotor.influence_coefficient
        faster = members.velocity_factor * members.moment_factor * members.influence_coefficient / nominal
        error = np.cos(members.lag_angle - self.shared["assumed_lag"][0])
        largest = self.loop.largest_staying / max(self.loop.limit / 2.0, 1e-300)
        return np.asarray(members.proportional * self.loop.rate * faster <= largest * np.maximum(error, 0.0))

    @classmethod
    def of(cls, *, scene: Scene, model: BalancerModel, dynamics: Dynamics) -> EnsemblePlan:
        """Prepare the runs of an ensemble."""
        shared, chambers, total = np.zeros(1, dtype=SHARED), scene.disc.chambers, 2 * scene.disc.initial_fill
        axes = chamber_directions(chambers)[: chambers // 2]
        moment = MomentTable.of(model=model, total=total)
        shared["total"], shared["lowest"] = total, moment.lowest
        shared["floods"] = floods(model.flow, total=total)
        parts = [part for z in (np.real, np.imag) for part in (z(moment.value), z(moment.slope))]
        shared["moment"], shared["moment_step"] = np.stack(parts, axis=1), moment.step
        shared["asymmetric"] = bool(np.any(moment.value.imag))
        shared["axis"][0, : axes.size] = np.stack([axes.real, axes.imag], axis=1)
        for name, value in (_loop(scene) | _controller(scene)).items():
            shared[name] = value
        loop = loop_factor(scene, model, target_vector_of(scene))
        shared["offset"][0, :chambers] = scene.controller.offsets(chambers)
        return cls(
            shared=shared,
            plant=dynamics.plant(total=total, relative_error=RELATIVE_ERROR),
            loop=loop,
            rotor=scene.rotor,
            drawing=Drawing.of(scene, law=model.flow),
        )


def _loop(scene: Scene) -> dict[str, float]:
    """Rotor, sensor, clock and bounds."""
    start, sensor = scene.rotor.initial_vibration, scene.sensor
    return {
        "initial_fill": scene.disc.initial_fill,
        "start_real": start.real,
        "start_imaginary": start.imag,
        "time_limit": scene.run.time_limit,
        "amplitude_noise": sensor.amplitude_noise,
        "phase_noise": sensor.phase_noise,
        "noise_floor": noise_floor(
            amplitude_noise=sensor.amplitude_noise, initial_amplitude=scene.rotor.initial_amplitude
        ),
        "rises_tolerated": target_vector_of(scene).rises_tolerated,
        "idle_tolerated": IDLE_OPERATIONS + scene.disc.chambers,
        "gas_points": GAS_POINTS,
        "tail_points": TAIL_POINTS,
        "most_samples": MOST_SAMPLES,
    }


def _controller(scene: Scene) -> dict[str, float]:
    """The target-vector algorithm's settings."""
    settings = scene.controller
    return {
        "chambers": scene.disc.chambers,
        "period": settings.period,
        "hold_time": settings.hold_time,
        "limit": settings.limit,
        "assumed_lag": settings.assumed_lag_angle,
        "integral_time": math.inf if settings.integral_time is None else settings.integral_time,
        "derivative_time": settings.derivative_time,
        "minimum_gas_time": settings.minimum_gas_time,
        "maximum_gas_time": settings.maximum_gas_time,
    }
