"""Runs of a scene's closed loop for given members, each as `simulate` does one, without its trace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.controller.algorithms.built_in import BuiltIn
from ringbalance.controller.algorithms.by_name import target_vector_of
from ringbalance.controller.ensemble.samples import LARGEST_RATIO, Members
from ringbalance.controller.formulas import AT_REST, HELD, IDLE, NOTICEABLE, RISING
from ringbalance.controller.loop_plan import LoopPlan, Records
from ringbalance.controller.tuning.loop_factor import LoopFactor, loop_factor
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import Drawing
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Scene

RELATIVE_ERROR: Final = 1e-4
"""Allowed to one step of a member's states: an injection then ends within 1e-6 in fill of a single run's, and
within 3e-5 without inertia."""
MOST_SAMPLES: Final = 100_000
"""Of one run without a trace."""
_NOISE: Final = 3
"""In the key of a member's noise, which the keys of drawn blocks do not have."""


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

    @classmethod
    def judged(cls, runs: Records, *, noise_floor: float) -> MemberRuns:
        """How finished runs ended, as `Facts.outcome` tells it of one. Args: `noise_floor`: m."""
        cause, since = runs["cause"], runs["since"]
        settled = (cause == HELD) | ((cause == AT_REST) & np.isfinite(since))
        drifted = (runs["drift"] > NOTICEABLE) & ~settled
        higher = runs["amplitude"] > runs["initial_amplitude"] + noise_floor
        grown = (cause == RISING) | ((cause == IDLE) & higher)
        return cls(
            settled=settled,
            settling_time=np.where(settled, since, np.inf),
            overshoots=runs["overshoots"].copy(),
            misadjustments=runs["misadjustments"].copy(),
            diverged=grown & ~settled & ~drifted,
            drifted=drifted,
            shortened=runs["shortened"].copy(),
            samples=runs["samples"].copy(),
            final_amplitude=runs["amplitude"].copy(),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class EnsemblePlan:
    """What all members of an ensemble share."""

    plan: LoopPlan
    loop: LoopFactor
    """Of a member with the scene's own values."""
    rotor: Rotor
    assumed_lag: float
    """rad."""
    drawing: Drawing
    """From which the residual fill of each member follows."""

    @classmethod
    def of(
        cls, *, scene: Scene, model: BalancerModel, dynamics: Dynamics, controller: BuiltIn | None = None
    ) -> EnsemblePlan:
        """Prepare the runs of an ensemble. Args: `controller`: default the scene's target vector."""
        algorithm = controller or target_vector_of(scene)
        plan = LoopPlan.of(
            scene=scene,
            model=model,
            dynamics=dynamics,
            controller=algorithm,
            relative_error=RELATIVE_ERROR,
            most_samples=MOST_SAMPLES,
        )
        return cls(
            plan=plan,
            loop=loop_factor(scene, model, algorithm),
            rotor=scene.rotor,
            assumed_lag=scene.controller.assumed_lag_angle,
            drawing=Drawing.of(scene, law=model.flow),
        )

    def run(self, members: Members, *, seed: int, number: int = 0) -> MemberRuns:
        """Run some members; `number`, of the first of them in the ensemble, identifies its noise."""

        def noise(place: int) -> np.random.Generator:
            key = np.random.SeedSequence(entropy=seed, spawn_key=(number + place, _NOISE))
            return np.random.Generator(np.random.PCG64(key))

        runs = self.plan.runs(members.proportional.size)
        runs["speed"], runs["proportional"] = members.velocity_factor, members.proportional
        runs["gain"] = members.moment_factor * members.influence_coefficient * np.exp(-1j * members.lag_angle)
        runs["residual_fill"] = members.residual_fill(self.drawing)
        runs["stays"] = self._stay(members)
        if members.gas_line is not None:
            runs["gas_line"] *= members.gas_line.T
            runs["gas_line"][:, 1] = np.minimum(runs["gas_line"][:, 1], LARGEST_RATIO)
        self.plan.finish(runs, noise)
        return MemberRuns.judged(runs, noise_floor=float(self.plan.loop["noise_floor"][0]))

    def _stay(self, members: Members) -> BoolArray:
        """Whether each member's loop is expected to stay within the limit, as `LoopFactor.stays`."""
        if not self.loop.fixed:
            return np.full(members.proportional.shape, self.loop.stays)
        nominal = self.rotor.influence_coefficient
        faster = members.velocity_factor * members.moment_factor * members.influence_coefficient / nominal
        error = np.cos(members.lag_angle - self.assumed_lag)
        largest = self.loop.largest_staying / max(self.loop.limit / 2.0, 1e-300)
        return np.asarray(members.proportional * self.loop.rate * faster <= largest * np.maximum(error, 0.0))
