"""Whole runs of one scene again and again as compiled code, each with its whole record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.controller.compiled_records import RUN
from ringbalance.controller.compiled_trace import PATH_COLUMNS, SAMPLE_COLUMNS, VALVE_COLUMNS, trace_run
from ringbalance.controller.ensemble import ensemble_transfer
from ringbalance.controller.ensemble_run import EnsemblePlan, ensemble_plan
from ringbalance.controller.rotor import influence
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.scene.models import Scene

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Trace:
    """One closed-loop run as arrays: what `simulate` records, with one instant where a wait moves nothing."""

    settled: bool
    settling_time: float | None
    """s, from which on the amplitude stays at or below the limit; None when not settled."""
    overshoots: int
    misadjustments: int
    time: FloatArray
    """s, shape (m,)."""
    vibration: npt.NDArray[np.complex128]
    """True, m zero-to-peak, shape (m,)."""
    fill_ratio: FloatArray
    """x of every chamber in the order of the letters, shape (n, m)."""
    sample_time: FloatArray
    """s, shape (samples,)."""
    sample_amplitude: FloatArray
    """As seen, m."""
    sample_phase: FloatArray
    """As seen, rad."""
    valve_time: FloatArray
    """s, at which a valve opens, shape (operations,)."""
    valve_chamber: IntArray
    """Index of the driven chamber."""
    valve_duration: FloatArray
    """s."""
    fill_before: FloatArray
    """x of the driven chamber when its valve opened."""
    fill_after: FloatArray
    """x of the driven chamber when the command's last valve had closed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedRun:
    """The target-vector loop of one scene under one law, ready to run."""

    plan: EnsemblePlan
    gain: complex
    """Vibration per unbalance, m/(kg m)."""
    proportional: float
    """Kc, s/m."""
    seed: int
    """The scene's own."""
    most_samples: int

    def run(self, seed: int | None = None) -> Trace:
        """One run.

        Args:
            seed: of the sensor's noise; default the scene's own.

        Returns:
            Trace, as `simulate` would record it with that seed.
        """
        shared, half = self.plan.shared[0], int(self.plan.shared["chambers"][0]) // 2
        noise = np.zeros((self.most_samples, 2))
        if shared["amplitude_noise"] or shared["phase_noise"]:
            generator = np.random.default_rng(self.seed if seed is None else seed)
            generator.standard_normal(out=noise)
        samples = np.empty((self.most_samples, SAMPLE_COLUMNS))
        valves = np.empty((2 * self.most_samples, VALVE_COLUMNS))
        each = int(shared["gas_points"]) + int(shared["drift_points"]) + 1
        path = np.empty((self.most_samples * each + 1, PATH_COLUMNS + half))
        run = np.zeros(1, dtype=RUN)
        run["speed"], run["proportional"] = 1.0, self.proportional
        run["gain_real"], run["gain_imaginary"] = self.gain.real, self.gain.imag
        count, rows = trace_run(shared, run[0], noise, samples, valves, path)
        return _trace(run[0], float(shared["total"]), samples, valves[:count], path[:rows])


def _trace(run: np.void, total: float, samples: FloatArray, valves: FloatArray, path: FloatArray) -> Trace:
    # A valve may open for less than the clock resolves: the record keeps one entry for one time.
    path = path[np.diff(path[:, 0], prepend=-1.0) > 0]
    seen, first = samples[: int(run["samples"])], path[:, PATH_COLUMNS:].T
    settled = bool(run["settled"])
    return Trace(
        settled=settled,
        settling_time=float(run["settling_time"]) if settled else None,
        overshoots=int(run["overshoots"]),
        misadjustments=int(run["misadjustments"]),
        time=path[:, 0],
        vibration=path[:, 1] + 1j * path[:, 2],
        fill_ratio=np.concatenate([first, total - first]),
        sample_time=seen[:, 0],
        sample_amplitude=seen[:, 1],
        sample_phase=seen[:, 2],
        valve_time=valves[:, 0],
        valve_chamber=valves[:, 1].astype(np.int64),
        valve_duration=valves[:, 2],
        fill_before=valves[:, 3],
        fill_after=valves[:, 4],
    )


def prepare_run(scene: Scene, model: BalancerModel) -> PreparedRun:
    """Prepare the target-vector loop of a scene for many runs.

    The flow law alone drives the liquid: terms that the scene's tolerance asks `simulate` to model beside it
    (`Ensemble.left_out`) are left out.

    Args:
        scene: the scene; its controller's `kind` is not looked at.
        model: the balancer.

    Returns:
        PreparedRun.

    Raises:
        SceneError: a rotor too slow to form a ring, a model made for another disc, or more samples than an
            ensemble may take.
        ValueError: a law that an ensemble cannot follow.
    """
    plan = ensemble_plan(scene=scene, model=model, transfer=ensemble_transfer(scene, model))
    rotor, settings = scene.rotor, scene.controller
    return PreparedRun(
        plan=plan,
        gain=influence(coefficient=rotor.influence_coefficient, lag_angle=rotor.lag_angle),
        proportional=settings.proportional,
        seed=scene.run.seed,
        most_samples=int(scene.run.time_limit / settings.period) + 2,
    )
