"""Record of a run with two eccentric masses: every sample, results derived from them, and findings."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Final

import numpy as np

from ringbalance.controller.eccentric_mass.drive_law import believed_whirl
from ringbalance.controller.eccentric_mass.memory import CAUSE_NAMES, STAGE_NAMES, Cause, Hold, Stage
from ringbalance.controller.eccentric_mass.outcome import OF_DRIVES, EccentricOutcome
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.resolution import rotor_covariance
from ringbalance.controller.eccentric_mass.sampled_loops import RecommendedGains
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.eccentric_mass.supervisor import STALLED_SHARE
from ringbalance.controller.eccentric_mass.targets import Targets, target_angles
from ringbalance.results.result import PresentedResult
from ringbalance.results.rows import Finding, Value, sentences
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Records, within_since
from ringbalance.scene.uncertain import NORMAL_95

_ROUNDING_FRACTION: Final = 1e-6
"""Vibration that counts as round-off, as a fraction of the limit."""
_FINAL_TIME_S: Final = 1.0
"""Time over which the final amplitude is averaged."""
_NOTICEABLE_STALL_FRACTION: Final = 0.05
"""Fraction of the friction stage with a mass nearly at standstill beyond which a warning is given."""
_WRONG_MODEL_INNOVATION: Final = 1.5
"""Mean normalised innovation squared beyond which the filter's model counts as wrong; for a true model it is
1 +- 0.1 after 100 samples, by the chi-square distribution."""
_SATURATED_FRACTION: Final = 0.5
"""Fraction of a run with a voltage at its limit beyond which that limit keeps masses from their goals."""
_RUN_AWAY_TURNS: Final = 5.0
"""Turns beyond which a mass has run away: all moves of a strategy together are shorter."""


@dataclass(frozen=True, kw_only=True)
class StageSpan:
    """Stage of the strategy in a run, with start and end."""

    name: str
    start: float
    """Start, s."""
    end: float
    """End, s."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class EccentricRun(PresentedResult):
    """Run of the whole strategy on the plant.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("driven_masses_small"))
        >>> run = rb.simulate(scene)
        >>> run.settled, run.residual_ratio < 0.1
        (True, True)
    """

    balancer: ClassVar = "eccentric_mass"

    scene: EccentricScene
    history: Records
    """Every sample, type `HISTORY`."""
    memory: np.void
    """Memory of the strategy at the end, type `MEMORY`."""

    @property
    def innovation(self) -> float | None:
        """Mean square of the imbalance filter's normalised innovations: 1 for a true model; None without
        samples."""
        judged = int(self.memory["estimation"]["judged"])
        return float(self.memory["estimation"]["surprise"]) / (4 * judged) if judged else None

    @cached_property
    def time(self) -> FloatArray:
        """Time of the samples, s, shape (n,)."""
        return np.arange(len(self.history["state"]), dtype=np.float64) * self.scene.sensor.step

    @cached_property
    def speed(self) -> FloatArray:
        """W, rad/s, shape (n,)."""
        return np.asarray(np.interp(self.time, *self.scene.rotor.profile))

    @cached_property
    def whirl(self) -> ComplexArray:
        """True displacement of the rotor along its own axes, m, shape (n,)."""
        return np.asarray(self.history["state"][:, 0] + 1j * self.history["state"][:, 1])

    @cached_property
    def amplitude(self) -> FloatArray:
        """True vibration, m zero-to-peak, shape (n,)."""
        return np.asarray(np.abs(self.whirl), dtype=np.float64)

    @property
    def phase(self) -> FloatArray:
        """Phase of the true vibration in the rotor's frame, rad within (-pi, pi], shape (n,)."""
        return np.asarray(np.angle(self.whirl), dtype=np.float64)

    @property
    def mass_angle(self) -> FloatArray:
        """True angles of the masses, rad, not wrapped, shape (2, n)."""
        return self.history["state"][:, 4:6].T

    @property
    def mass_rate(self) -> FloatArray:
        """True rates of the masses, rad/s, shape (2, n)."""
        return self.history["state"][:, 6:8].T

    @property
    def goal(self) -> FloatArray:
        """Angles that the masses should have, rad, shape (2, n)."""
        return self.history["goal"].T

    @property
    def voltage(self) -> FloatArray:
        """Voltages of the motors, V, shape (2, n)."""
        return self.history["voltage"].T

    @property
    def drive_off(self) -> BoolArray:
        """True where both drives are off, shape (n,)."""
        return np.asarray(self.history["hold"] == Hold.RELEASED)

    @property
    def limit(self) -> float:
        """Amplitude limit, m."""
        return self.scene.supervisor.limit

    @property
    def stage(self) -> int:
        """Stage at the end of the run."""
        return int(self.history["stage"][-1])

    @property
    def end(self) -> float:
        """Time of the last sample, s."""
        return float(self.time[-1])

    @property
    def diverged(self) -> bool:
        """True if the run diverged and ended early, at its last valid sample."""
        return self.time.size < self.scene.samples

    @cached_property
    def left(self) -> int | None:
        """Sample of the largest vibration above the limit after the rotor was balanced within it; None if it
        stays within.
        """
        done = np.isin(self.history["cause"], (Cause.BALANCED, Cause.SPEED_CHANGED))
        within = np.flatnonzero(done & (self.amplitude <= self.limit))
        if within.size == 0:
            return None
        worst = int(within[0]) + int(np.argmax(self.amplitude[within[0] :]))
        return worst if self.amplitude[worst] > self.limit else None

    @cached_property
    def within_since(self) -> float | None:
        """Time of the sample from which on the amplitude stays within the limit, s; None if it ends above."""
        return within_since(self.time, self.amplitude, limit=self.limit)

    @cached_property
    def outcome(self) -> EccentricOutcome:
        """Outcome; SETTLED if the true amplitude stays within the limit to the end, in any stage."""
        if self.diverged:
            return EccentricOutcome.DIVERGED
        speed = self.speed
        last_cause = cause = int(self.history["cause"][-1])
        if cause == Cause.LOCKED:
            return EccentricOutcome.LOCKED
        # A run that ends within a stage may already show why the stage would have failed.
        if self.stage == Stage.IMBALANCE_ESTIMATION and abs(speed[-1]) < self.scene.supervisor.lowest_speed:
            cause = Cause.TOO_SLOW
        elif self.stage == Stage.IMBALANCE_ESTIMATION and speed.size > 1 and speed[-1] != speed[-2]:
            cause = Cause.SPEED_NOT_CONSTANT
        elif self.stage == Stage.FRICTION_ESTIMATION and self._stalled_fraction > STALLED_SHARE:
            cause = Cause.STALLED
        # The amplitude of a rotor that is too slow proves nothing.
        if cause != Cause.TOO_SLOW and self.within_since is not None and self.left is None:
            return EccentricOutcome.SETTLED
        if last_cause == Cause.BALANCED:
            return EccentricOutcome.RISES_AGAIN
        return EccentricOutcome.TIME_LIMIT if cause == Cause.NONE else EccentricOutcome(CAUSE_NAMES[cause])

    @property
    def settling_time(self) -> float | None:
        """Time from which on the amplitude stays at or below the limit, s; None when not settled."""
        ended_well = self.outcome in {EccentricOutcome.SETTLED, EccentricOutcome.LOCKED}
        return self.within_since if ended_well else None

    @property
    def settled(self) -> bool:
        """True if the amplitude ends at or below the limit and stays there."""
        return self.settling_time is not None

    @cached_property
    def estimated_at(self) -> IntArray:
        """Samples at which the imbalance was estimated."""
        return np.flatnonzero(self.history["stage"] == Stage.IMBALANCE_ESTIMATION)

    @property
    def friction_known(self) -> bool:
        """True if the friction stage was completed, hence its drives suffice."""
        return bool(np.any(self.history["stage"] == Stage.POSITIONING))

    @property
    def _stalled_fraction(self) -> float:
        """Fraction of the friction stage with a mass nearly at standstill."""
        friction = self.memory["friction"]
        return int(friction["stalled"]) / max(int(friction["driven"]), 1)

    @property
    def imbalance(self) -> complex:
        """Imbalance as estimated at the end, kg m."""
        return complex(*self.history["imbalance"][-1])

    @cached_property
    def rotor_covariance(self) -> FloatArray:
        """Covariance of the estimated imbalance by rotor and masses, kg^2 m^2, shape (2, 2)."""
        estimating, step = self.estimated_at, self.scene.sensor.step
        if estimating.size == 0:
            return np.zeros((2, 2))
        return rotor_covariance(
            self.scene,
            imbalance=self.imbalance,
            speed=float(self.speed[estimating[-1]]),
            begin=float(estimating[0]) * step,
            duration=estimating.size * step,
        )

    @property
    def imbalance_covariance(self) -> FloatArray:
        """Covariance of the imbalance estimated at the end, by noise and rotor, kg^2 m^2, shape (2, 2)."""
        return np.asarray(self.history["imbalance_covariance"][-1] + self.rotor_covariance)

    @property
    def friction_half_width(self) -> FloatArray:
        """Half-widths (95 %) of the friction arms, m, by noise, motor and masses, shape (2,)."""
        doubt = np.square(self.memory["friction"]["arm_doubt"])
        return np.asarray(NORMAL_95 * np.sqrt(self.history["friction_variance"][-1] + doubt))

    @property
    def stages(self) -> tuple[StageSpan, ...]:
        """Stages of the strategy in order of time."""
        stage, time = self.history["stage"], self.time
        edges = [0, *(np.flatnonzero(np.diff(stage)) + 1), len(stage) - 1]
        return tuple(
            StageSpan(name=STAGE_NAMES[stage[a]], start=float(time[a]), end=float(time[b]))
            for a, b in itertools.pairwise(edges)
        )

    @property
    def targets(self) -> Targets | None:
        """Targets for the estimated imbalance; None if the run never came to positioning."""
        if not self.friction_known:
            return None
        x, y = self.history["imbalance"][-1]
        moment = PlantParameters.of(self.scene).moment
        return target_angles(float(np.hypot(x, y)), float(np.arctan2(y, x)), moment, self.scene.masses.gap)

    @property
    def unbalanced_amplitude(self) -> float:
        """Steady amplitude with the masses at their initial angles, at the last speed, m."""
        speed = float(self.speed[-1])
        if speed == 0:
            return 0.0
        return abs(PlantParameters.of(self.scene).steady_whirl(speed, self.scene.masses.initial_angle))

    @property
    def final_amplitude(self) -> float:
        """Mean amplitude over the last second, m."""
        return float(np.mean(self.amplitude[self.time >= self.time[-1] - _FINAL_TIME_S]))

    @property
    def residual_ratio(self) -> float | None:
        """Final amplitude over `unbalanced_amplitude`; None if the latter is zero but for rounding."""
        unbalanced = self.unbalanced_amplitude
        return None if unbalanced < _ROUNDING_FRACTION * self.limit else self.final_amplitude / unbalanced

    @property
    def electrical_energy(self) -> float:
        """Energy that both motors took from the supply in the whole run, J."""
        return float(self.history["energy"][-1])

    @property
    def worst_amplitude(self) -> float:
        """Largest true vibration amplitude of the run, m."""
        return float(np.max(self.amplitude))

    @property
    def saturation(self) -> float:
        """Time for which a voltage was at its limit, s."""
        most = PlantParameters.of(self.scene).maximum_voltage
        at_limit = np.any(np.abs(self.history["voltage"]) >= most, axis=1)
        return float(np.count_nonzero(at_limit)) * self.scene.sensor.step

    @property
    def least_gap(self) -> float:
        """Smallest angle between the masses during the run, rad."""
        first, second = self.mass_angle
        return float(np.min(np.abs(np.pi - np.mod(np.pi - (second - first), 2 * np.pi))))

    @property
    def run_away(self) -> float:
        """Largest net travel of a mass from the start of positioning to the end of the run, turns."""
        if not self.friction_known:
            return 0.0
        start = int(np.argmax(self.history["stage"] == Stage.POSITIONING))
        return float(np.max(np.abs(self.mass_angle[:, -1] - self.mass_angle[:, start]))) / (2 * np.pi)

    @cached_property
    def _numbers(self) -> dict[str, Value]:
        """Values by the names that sentences use; those of [supervisor] under its keys."""
        scene, worst = self.scene, self.left
        # Standard deviation of the imbalance by noise, kg m.
        deviation = float(np.sqrt(np.max(np.linalg.eigvalsh(self.history["imbalance_covariance"][-1]))))
        return {
            **vars(scene.supervisor),
            "final_amplitude": float(self.amplitude[-1]),
            "time": self.end,
            "settling_time": self.within_since,
            "later_amplitude": None if worst is None else float(self.amplitude[worst]),
            "later_speed": None if worst is None else float(self.speed[worst]),
            "imbalance": abs(self.imbalance),
            "reach": 2 * scene.masses.mass * scene.masses.guide_radius,
            "residual": float(self.memory["correction"]["left"]),
            "average": scene.fine_tuning.average,
            "mean_noise": scene.mean_noise,
            "deviation_ratio": deviation / abs(self.imbalance) if self.imbalance else None,
            "imbalance_gate": scene.imbalance_filter.gate,
            "friction_gate": scene.friction_filter.gate,
            "stage": STAGE_NAMES[self.stage],
            "turns": self.run_away,
            "cause": CAUSE_NAMES[int(self.history["cause"][-1])].replace("_", " "),
            "stalled_fraction": self._stalled_fraction,
            "saturation": self.saturation,
            "euler_limit": _euler_limit(self),
            "innovation": self.innovation,
            "least_gap": self.least_gap,
            "own_angle": scene.masses.gap,
        }

    def _finding(self, code: str) -> Finding:
        return Finding(code=code, values={name: self._numbers[name] for name in sentences()[code].values})

    @cached_property
    def ended(self) -> Finding:
        """Finding on the end of the run, with its numbers."""
        if self.outcome in OF_DRIVES and (unstable := next(unstable_loops(self.scene), None)):
            values = {**self._numbers, **unstable.values}
            names = sentences()["masses_unstable"].values
            finding = Finding(code="masses_unstable", values={name: values[name] for name in names})
            return replace(finding, change=unstable.change)
        code = f"masses_{self.outcome.value}"
        if self.outcome in OF_DRIVES and self.run_away > _RUN_AWAY_TURNS:
            saturated = self.saturation > _SATURATED_FRACTION * self.end
            code = "masses_run_away" if saturated else "masses_turn"
        elif self.outcome is EccentricOutcome.SETTLED and self.stage != Stage.REST:
            code = "strategy_failed" if self.stage == Stage.FAILED else "strategy_not_finished"
        elif self.outcome is EccentricOutcome.LOCKED and self.within_since is not None:
            code = "masses_locked_within"
        elif (
            self.outcome is EccentricOutcome.NOT_ARRIVED and self.stages[-2].name == STAGE_NAMES[Stage.CHECK]
        ):
            code = "masses_held_short"
        elif self.outcome is EccentricOutcome.RISES_AGAIN and self.left is None:
            code = "masses_not_kept"
        elif self.outcome is EccentricOutcome.RISES_AGAIN and self.left is not None:
            # Masses have moved, or the mean did not show the vibration, or the speed magnifies the residual.
            first = int(np.argmax(self.history["cause"] == Cause.BALANCED))
            moved = np.abs(self.mass_angle[:, first : self.left + 1] - self.mass_angle[:, [first]])
            by_trials = self.scene.supervisor.correction == "trials"
            code = "masses_rises_by_trials" if by_trials else "masses_rises_by_speed"
            if np.max(moved, initial=0.0) > self.scene.supervisor.arrival_angle:
                code = "masses_rises_again"
            elif self.speed[self.left] == self.speed[first]:
                code = "masses_not_kept"
        return self._finding(code)

    @cached_property
    def warned(self) -> tuple[Finding, ...]:
        """Findings that a user should know although the run continued."""
        keys = self.scene.imbalance_filter
        unlike = self.innovation is not None and self.innovation > _WRONG_MODEL_INNOVATION
        # The Euler transition is the cause to remove first.
        by_euler = keys.discretisation == "euler" and (unlike or keys.step > _euler_limit(self))
        nearly_stalled = self._stalled_fraction > _NOTICEABLE_STALL_FRACTION
        due = {
            "drive_nearly_stalled": nearly_stalled and not self.friction_known,
            "voltage_at_limit": self.saturation > 0,
            "euler_too_coarse": by_euler,
            "innovations_unlike_model": unlike and not by_euler,
            "drives_stay_on": int(self.history["hold"][-1]) == Hold.HELD,
            "masses_meet": self.least_gap < self.scene.masses.gap,
        }
        return (*unstable_loops(self.scene), *(self._finding(code) for code, is_due in due.items() if is_due))

    @property
    def status(self) -> str:
        """End of the run and what to do next, as a sentence."""
        return self.ended.text

    @property
    def warnings(self) -> tuple[str, ...]:
        """Findings that a user should know, as sentences."""
        return tuple(each.text for each in self.warned)


def _euler_limit(run: EccentricRun) -> float:
    """Longest step of the paper's transition at the highest speed of the estimation, s."""
    speeds = np.abs(run.speed[run.estimated_at])
    fastest = float(speeds.max()) if speeds.size else 0.0
    return float(believed_whirl(run.scene).euler_step_limit(angular_velocity=fastest))


def unstable_loops(scene: EccentricScene) -> Iterator[Finding]:
    """Yield each loop whose poles are outside the unit circle, with the gain or the hold that suffices."""
    if scene.supervisor.strategy == "locked":
        return
    gains = RecommendedGains.of(scene)
    for loop in gains.loops:
        if not loop.stable and not (loop is gains.pair and not gains.speed.stable):
            numbers = {"radius": loop.radius, "gain": loop.recommended, "hold": loop.recommended_step}
            yield Finding(
                code="loop_unstable",
                values={"loop": loop.name, "key": loop.key, **numbers},
                change={loop.key: loop.recommended},
            )
