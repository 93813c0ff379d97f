"""Many closed-loop runs of the target-vector algorithm side by side, each as `simulate` does one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.ensemble_members import Members
from ringbalance.controller.ensemble_pid import VectorPid
from ringbalance.controller.ensemble_transfer import PairTransfer, moment_table
from ringbalance.controller.judgement import noise_floor
from ringbalance.controller.liquid_ring import NOTICEABLE
from ringbalance.controller.loop import GAS_POINTS, IDLE_OPERATIONS, MAX_SAMPLES
from ringbalance.controller.outcome import CONFIRMING_SAMPLES
from ringbalance.controller.rotor import chamber_directions, initial_vibration
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.scene.models import Scene

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
Noise = Callable[[int], FloatArray]
"""Takes the number of the sample, from 0 on in order; standard normal numbers, shape (2, members)."""

RISES_TOLERATED: Final = 2
"""As `TargetVector.rises_tolerated`."""


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
    """Stopped because liquid could run back with the gas off, which the ensemble does not follow."""
    samples: IntArray
    final_amplitude: FloatArray
    """m."""


def run_members(
    *, scene: Scene, model: BalancerModel, transfer: PairTransfer, members: Members, noise: Noise
) -> MemberRuns:
    """Run the target-vector algorithm for every member.

    Args:
        scene: rotor, sensor, controller settings and time limit.
        model: the balancer.
        transfer: its operations, of `pair_transfer`.
        members: what differs between the runs.
        noise: what the sensors add.

    Returns:
        MemberRuns, each entry as `simulate` judges that member.

    Source: as `simulate`.
    """
    run = _Runs(scene, model, transfer, members)
    for number in range(MAX_SAMPLES):
        if run.alive.size == 0:
            break
        run.sample(number, noise(number))
    run.finish(run.alive, np.zeros(run.alive.size, dtype=np.bool_))
    return run.results()


class _Runs:
    """What changes during one call of `run_members`; arrays of shape (members,) or (pairs, members)."""

    def __init__(self, scene: Scene, model: BalancerModel, transfer: PairTransfer, members: Members) -> None:
        self.scene, self.transfer, self.members = scene, transfer, members
        size, half = members.proportional.size, scene.disc.chambers // 2
        self.half, self.total = half, 2 * scene.disc.initial_fill
        self.pair_moment = moment_table(model=model, total=self.total)
        self.axes = chamber_directions(scene.disc.chambers)[:half]
        self.gain = members.moment_factor * members.influence_coefficient * np.exp(-1j * members.lag_angle)
        self.initial = initial_vibration(rotor=scene.rotor)
        self.floor = noise_floor(
            amplitude_noise=scene.sensor.amplitude_noise, initial_amplitude=scene.rotor.initial_amplitude
        )
        self.exact = scene.sensor.amplitude_noise == scene.sensor.phase_noise == 0
        self.pid = VectorPid(scene=scene, proportional=members.proportional)
        self.alive: IntArray = np.arange(size)
        self.fill = np.full((half, size), scene.disc.initial_fill)
        self.moment = np.zeros((half, size))
        self.time = np.zeros(size)
        self.amplitude = np.full(size, abs(self.initial))
        self.phase = np.full(size, float(np.angle(self.initial)))
        self.settle = np.where(self.amplitude > scene.controller.limit, np.inf, 0.0)
        self.last_times = np.zeros((CONFIRMING_SAMPLES, size))
        self.seen, self.first_seen, self.seen_phase = (np.zeros(size) for _ in range(3))
        self.operated, self.settled, self.diverged, self.drifted = (
            np.zeros(size, dtype=np.bool_) for _ in range(4)
        )
        self.rises, self.idle, self.overshoots, self.misadjustments, self.samples = (
            np.zeros(size, dtype=np.int64) for _ in range(5)
        )

    def sample(self, number: int, z: FloatArray) -> None:
        """One sample of every run that goes on: judge, decide, end, or let gas in and wait."""
        a, sensor = self.alive, self.scene.sensor
        amplitude = np.abs(self.amplitude[a] + sensor.amplitude_noise * z[0, a])
        phase = self.phase[a] + sensor.phase_noise * z[1, a]
        self.last_times[number % CONFIRMING_SAMPLES, a] = self.time[a]
        self.samples[a] = number + 1
        self._judge(number, a, amplitude, phase)
        above = amplitude > self.scene.controller.limit
        self.pid.rest(a[~above])
        acting, command = a[above], self.pid.step(a[above], amplitude[above], phase[above], self.time)
        ended = self._ended(a, ~above)
        rising = self._rising(a)
        self.finish(a[ended], rising[ended])
        goes_on = ~ended[above]
        self._gas(acting[goes_on], command.chambers[:, goes_on], command.durations[:, goes_on])
        self.alive = a[~ended & ~self.drifted[a]]
        left = self.scene.run.time_limit - self.time[self.alive]
        self.time[self.alive] += np.minimum(self.scene.controller.period, np.maximum(left, 0.0))

    def _judge(self, number: int, a: IntArray, amplitude: FloatArray, phase: FloatArray) -> None:
        """Overshoots, rises and misadjustments by what was sampled, as `judgement` has them."""
        if number == 0:
            self.first_seen[a] = amplitude
        else:
            above = np.flatnonzero(amplitude > self.scene.controller.limit)
            self.overshoots[a[above]] += np.cos(phase[above] - self.seen_phase[a[above]]) < 0
            after = np.flatnonzero(self.operated[a])
            who = a[after]
            higher = amplitude[after] - self.seen[who] > self.floor
            self.misadjustments[who] += higher
            self.rises[who] = np.where(higher, self.rises[who] + 1, 0)
        self.seen[a], self.seen_phase[a], self.operated[a] = amplitude, phase, False

    def _rising(self, a: IntArray) -> BoolArray:
        rises = self.rises[a]
        higher = self.seen[a] - self.first_seen[a] > self.floor
        return np.asarray((rises > RISES_TOLERATED) | ((rises == RISES_TOLERATED) & higher))

    def _ended(self, a: IntArray, resting: BoolArray) -> BoolArray:
        over = self.scene.run.time_limit - self.time[a] <= 0
        idle = self.idle[a] >= IDLE_OPERATIONS + 2 * self.half
        return np.asarray(self._rising(a) | idle | over | (resting & self.exact))

    def finish(self, who: IntArray, rising: BoolArray) -> None:
        """Judge runs that end now, as `outcome_of` does."""
        oldest = np.maximum(self.samples[who] - CONFIRMING_SAMPLES, 0) % CONFIRMING_SAMPLES
        at_rest = self.exact & (self.seen[who] <= self.scene.controller.limit) & ~rising
        confirmed = np.where(at_rest, self.time[who], self.last_times[oldest, who])
        self.settled[who] = self.settle[who] <= confirmed
        idle = self.idle[who] >= IDLE_OPERATIONS + 2 * self.half
        higher = self.amplitude[who] > abs(self.initial) + self.floor
        self.diverged[who] = ~self.settled[who] & (rising | (idle & higher))

    def _gas(self, who: IntArray, chambers: IntArray, durations: FloatArray) -> None:
        """All valves of a command open together; pairs flow in parallel."""
        left = self.scene.run.time_limit - self.time[who]
        durations = np.minimum(durations, left)
        opens = np.flatnonzero(np.any(durations > 0, axis=0))
        who, chambers, durations = who[opens], chambers[:, opens], durations[:, opens]
        self.operated[who] = True
        before = self.fill[:, who].copy()
        old_moment = self.moment[:, who].copy()
        for chamber, duration in zip(chambers, durations, strict=True):
            pair, driven = self._driven(who, chamber)
            after = self._after(who, driven, duration)
            self._put(who, chamber, pair, after)
        moved = np.any(np.abs(self.fill[:, who] - before) > NOTICEABLE, axis=0)
        self.idle[who] = np.where(moved, 0, self.idle[who] + 1)
        self._settle(who, chambers, durations, (before, old_moment))
        self.time[who] += durations.max(axis=0, initial=0.0)

    def _driven(self, who: IntArray, chamber: IntArray) -> tuple[IntArray, FloatArray]:
        pair = chamber % self.half
        x = self.fill[pair, who]
        return pair, np.where(chamber < self.half, x, self.total - x)

    def _after(self, who: IntArray, driven: FloatArray, duration: FloatArray) -> FloatArray:
        """Fill of the driven chamber once its valve has closed."""
        flows = (duration > 0) & self.transfer.starts(driven)
        time = np.where(flows, duration * self.members.velocity_factor[who], 0.0)
        found = self.transfer.after(driven, time)
        return np.where(flows, found, driven)

    def _put(self, who: IntArray, chamber: IntArray, pair: IntArray, driven: FloatArray) -> None:
        x = np.where(chamber < self.half, driven, self.total - driven)
        self.drifted[who] |= self.transfer.holds(driven) & (np.abs(x - self.fill[pair, who]) > NOTICEABLE)
        self.fill[pair, who] = x
        self.moment[pair, who] = self.pair_moment(x)

    def _vibration(self, who: IntArray, moment: FloatArray) -> npt.NDArray[np.complex128]:
        gain = self.gain[who].reshape((-1,) + (1,) * (moment.ndim - 2))
        # Pair by pair in real numbers: a complex product of matrices would take most of the run.
        real, imaginary = (
            sum(float(e) * m for e, m in zip(part, moment, strict=True))
            for part in (self.axes.real, self.axes.imag)
        )
        return np.asarray(self.initial + gain * (real + 1j * imaginary))

    def _settle(
        self,
        who: IntArray,
        chambers: IntArray,
        durations: FloatArray,
        old: tuple[FloatArray, FloatArray],
    ) -> None:
        """Vibration after the gas, and since when it has not been above the limit."""
        limit = self.scene.controller.limit
        above_before = self.amplitude[who] > limit
        seen = self._vibration(who, self.moment[:, who])
        self.amplitude[who], self.phase[who] = np.abs(seen), np.angle(seen)
        below = np.flatnonzero(self.amplitude[who] <= limit)
        self.settle[who[self.amplitude[who] > limit]] = np.inf
        if below.size == 0:
            return
        at, amplitude = self._path(
            who[below], chambers[:, below], durations[:, below], tuple(part[:, below] for part in old)
        )
        above = np.concatenate([above_before[below][:, None], amplitude > limit], axis=1)
        last = above.shape[1] - 1 - np.argmax(above[:, ::-1], axis=1)
        # The instants recorded begin after the one before the gas, so the next one has the same index.
        found = at[np.arange(below.size), np.minimum(last, at.shape[1] - 1)]
        some = np.any(above, axis=1)
        mine = who[below]
        self.settle[mine] = np.where(some, self.time[mine] + found, self.settle[mine])

    def _path(
        self, who: IntArray, chambers: IntArray, durations: FloatArray, old: tuple[FloatArray, ...]
    ) -> tuple[FloatArray, FloatArray]:
        """Instants within a command that `simulate` records, and the amplitude there."""
        spaced = durations.max(axis=0)[:, None] * np.arange(1, GAS_POINTS + 1) / GAS_POINTS
        at = np.sort(np.concatenate([spaced, durations.T], axis=1), axis=1)
        at = np.where(at > 0, at, spaced[:, :1])
        at.sort(axis=1)
        fill, moment = old
        path = np.repeat(moment[:, :, None], at.shape[1], axis=2)
        for chamber, duration in zip(chambers, durations, strict=True):
            pair = chamber % self.half
            x = fill[pair, np.arange(who.size)]
            first = chamber < self.half
            driven = np.where(first, x, self.total - x)
            open_time = np.minimum(at, duration[:, None])
            flows = (duration > 0) & self.transfer.starts(driven)
            time = open_time * np.where(flows, self.members.velocity_factor[who], 0.0)[:, None]
            found = self.transfer.after(driven[:, None], time)
            found = np.where(flows[:, None], found, driven[:, None])
            x = np.where(first[:, None], found, self.total - found)
            path[pair, np.arange(who.size)] = self.pair_moment(x)
        return at, np.abs(self._vibration(who, path))

    def results(self) -> MemberRuns:
        """The runs as they ended."""
        return MemberRuns(
            settled=self.settled,
            settling_time=np.where(self.settled, self.settle, np.inf),
            overshoots=self.overshoots,
            misadjustments=self.misadjustments,
            diverged=self.diverged,
            drifted=self.drifted,
            samples=self.samples,
            final_amplitude=self.amplitude,
        )
