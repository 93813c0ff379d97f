"""Monte-Carlo of noisy closed-loop runs over what nobody knows exactly, block by block in flat memory."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.built_in import BuiltIn
from ringbalance.controller.algorithms.by_name import target_vector_of
from ringbalance.controller.loop_plan import LoopPlan, Records
from ringbalance.controller.loop_records import AT_REST, HELD, IDLE, NOTICEABLE, RISING
from ringbalance.controller.members import BLOCK, LARGEST_RATIO, Members, MemberUncertainty
from ringbalance.controller.terms import check_fit, dynamics_of, run_models, terms_modelled
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.flow_law import BalancerModel, CompleteLaw, FlowLaw
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import NORMAL_95

Progress = Callable[[int, int], None]
"""Called with the members done and their number."""

QUANTILES: Final = (0.05, 0.25, 0.5, 0.75, 0.95)
TIME_BINS: Final = 20_000
"""In which settling times are counted; a quantile is known to a bin's width."""
_ROUND_OFF: Final = 1e-9
"""Of a fraction of all members, in members."""
SHOWN_BINS: Final = 40
MOST_COUNTED: Final = 10
"""Overshoots or misadjustments in one run that are still counted apart."""
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
        cause = runs["cause"]
        since = np.minimum(runs["held_since"], runs["since"])
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


Noise = Callable[[int], np.random.Generator]
"""Makes the random numbers of a member by its place."""


def member_noise(seed: int, number: int) -> np.random.Generator:
    """Random numbers of a member of an ensemble."""
    key = np.random.SeedSequence(entropy=seed, spawn_key=(number, _NOISE))
    return np.random.Generator(np.random.PCG64(key))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Plan:
    """What all members of an ensemble share."""

    scene: Scene
    plan: LoopPlan
    law: FlowLaw

    @classmethod
    def of(
        cls, scene: Scene, model: BalancerModel, *, dynamics: Dynamics | None, controller: BuiltIn | None
    ) -> _Plan:
        algorithm = controller or target_vector_of(scene)
        plan = LoopPlan.of(
            scene=scene,
            model=model,
            dynamics=dynamics or ensemble_dynamics(scene, model),
            controller=algorithm,
            relative_error=RELATIVE_ERROR,
            most_samples=MOST_SAMPLES,
        )
        return cls(scene=scene, plan=plan, law=model.flow)

    def run(self, members: Members, noise: Noise) -> MemberRuns:
        runs = self.plan.runs(members.proportional.size)
        runs["speed"], runs["proportional"] = members.velocity_factor, members.proportional
        runs["gain"] = members.moment_factor * members.influence_coefficient * np.exp(-1j * members.lag_angle)
        runs["residual_fill"] = members.residual_fill(self.scene, law=self.law)
        if members.gas_line is not None:
            runs["gas_line"] *= members.gas_line.T
            runs["gas_line"][:, 1] = np.minimum(runs["gas_line"][:, 1], LARGEST_RATIO)
        self.plan.finish(runs, noise)
        return MemberRuns.judged(runs, noise_floor=float(self.plan.loop["noise_floor"][0]))


@dataclass(frozen=True, kw_only=True)
class Probability:
    """A share of the members."""

    value: float
    low: float
    """95 % interval of a binomial share."""
    high: float

    @classmethod
    def counted(cls, *, count: int, of: int) -> Probability:
        """A fraction with its 95 % interval.

        Source: Wilson, "Probable Inference, the Law of Succession, and Statistical Inference", JASA 22
            (1927).
        """
        p, z2 = count / of, NORMAL_95**2 / of
        centre = (p + z2 / 2) / (1 + z2)
        half = math.sqrt(p * (1 - p) * z2 + z2**2 / 4) / (1 + z2)
        return cls(value=p, low=max(centre - half, 0.0), high=min(centre + half, 1.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Ensemble:
    """What becomes of a scene's closed loop when what is uncertain varies."""

    law: str
    members: int
    seed: int
    uncertainty_95: MemberUncertainty
    settled: Probability
    not_settled: Probability
    overshoot: Probability
    """At least one overshoot."""
    misadjustment: Probability
    """At least one misadjustment."""
    diverged: Probability
    drifted: Probability
    """Not settled, and liquid ran back with the gas off."""
    settling_quantiles: tuple[float | None, ...]
    """s, by which fractions of all members have settled, `QUANTILES` by default; None: fewer have."""
    bin_width: float
    """s."""
    time_counts: IntArray
    """Settled members by settling time, shape (TIME_BINS,)."""
    overshoot_counts: IntArray
    """Members by number of overshoots, the last entry is that many or more."""
    misadjustment_counts: IntArray
    """Members by number of misadjustments, likewise."""

    def document(self) -> dict[str, Any]:
        """All as a JSON document of SI numbers, with arrays of at most 41 entries."""
        shares = ("settled", "not_settled", "overshoot", "misadjustment", "diverged", "drifted")
        last = int(np.max(np.flatnonzero(self.time_counts), initial=0)) + 1
        per_bin = -(-last // SHOWN_BINS)
        padded = np.zeros(per_bin * SHOWN_BINS, dtype=np.int64)
        padded[:last] = self.time_counts[:last]
        counts = padded.reshape(SHOWN_BINS, per_bin).sum(axis=1)
        edges = self.bin_width * per_bin * np.arange(SHOWN_BINS + 1)
        return {
            "law": self.law,
            "members": self.members,
            "seed": self.seed,
            "spread_95": self.uncertainty_95.document(),
            "left_out": [],
            "probability": {name: asdict(getattr(self, name)) for name in shares},
            "settling_time_s": {
                "quantiles": dict(zip(map(str, QUANTILES), self.settling_quantiles, strict=True)),
                "resolution": self.bin_width,
                "edges": edges.tolist(),
                "counts": counts.tolist(),
                "settled_fraction": (np.cumsum(counts) / self.members).tolist(),
            },
            "overshoots": self.overshoot_counts.tolist(),
            "misadjustments": self.misadjustment_counts.tolist(),
        }


def simulate_ensemble(
    scene: Scene,
    flow_law: CompleteLaw | BalancerModel,
    n: int,
    seed: int,
    *,
    uncertainty_95: MemberUncertainty | None = None,
    dynamics: Dynamics | None = None,
    controller: BuiltIn | None = None,
    quantiles: Sequence[float] = QUANTILES,
    workers: int = 2,
    progress: Progress | None = None,
) -> Ensemble:
    """Distributions over n noisy runs under a flow law.

    Every member has its own speed of flow, moment, influence coefficient, lag angle and noise; the algorithm
    keeps the assumptions and the gain of the scene. Inertia, gas filling and valve lag are modelled as in a
    single run. The same seed gives the same numbers for any number of threads (`workers`), and a larger
    ensemble begins with the members of a smaller one.
    Args: `controller`: default the scene's target vector, whatever its `controller.kind`.
    Raises: SceneError: a rotor too slow to form a ring, a model made for another disc, or more samples than a
        run may take.
    Raises: ValueError: no members, no workers, or a law that an ensemble cannot follow.
    """
    if n < 1 or workers < 1:
        raise ValueError(f"an ensemble needs members and workers, not n={n} and workers={workers}")
    model = flow_law if isinstance(flow_law, BalancerModel) else BalancerModel.of(flow_law)
    widths = MemberUncertainty.of(scene, model) if uncertainty_95 is None else uncertainty_95
    plan = _Plan.of(scene, model, dynamics=dynamics, controller=controller)
    tally = _Tally(time_limit=scene.run.time_limit, quantiles=quantiles)

    def run(block: int) -> MemberRuns:
        drawn = Members.drawn(scene, uncertainty_95=widths, seed=seed, block=block)
        first = block * BLOCK
        return plan.run(drawn.at(slice(n - first)), lambda place: member_noise(seed, first + place))

    for runs in _in_order(run, blocks=math.ceil(n / BLOCK), workers=workers):
        tally.add(runs)
        if progress is not None:
            progress(tally.members, n)
    return tally.ensemble(law=model.name, seed=seed, uncertainty_95=widths)


def simulate_members(
    scene: Scene,
    model: BalancerModel,
    *,
    members: Members | None = None,
    size: int = 1,
    noise: Noise | None = None,
    controller: BuiltIn | None = None,
) -> MemberRuns:
    """Run given members, by default `size` alike ones, and keep how each ended.

    Args: `noise`: default that of an ensemble's first members with the seed 0. `controller`: default the
        scene's target vector.
    Raises: SceneError, ValueError: as `simulate_ensemble`.
    """
    given = Members.alike(scene, size=size) if members is None else members
    return _Plan.of(scene, model, dynamics=None, controller=controller).run(
        given, noise or partial(member_noise, 0)
    )


def ensemble_dynamics(scene: Scene, model: BalancerModel) -> Dynamics:
    """What moves the liquid of a scene's balancer, after the checks of `simulate_ensemble`."""
    check_ring(scene)
    check_fit(scene, model)
    longest = scene.run.time_limit
    if longest / scene.controller.period > 50_000:
        fault = scene_fault(
            scene,
            "controller.period",
            problem="an ensemble takes at most 50000 samples in run.time_limit",
            allowed=f"at least {longest / 50_000:.3g} s",
        )
        raise SceneError([fault])
    modelled = terms_modelled(run_models(scene=scene, model=model))
    return dynamics_of(scene=scene, model=model, modelled=modelled)


def _in_order(run: Callable[[int], MemberRuns], *, blocks: int, workers: int) -> Iterator[MemberRuns]:
    """Blocks in their order, a few ahead in threads, so that no more than those are in memory."""
    if workers == 1 or blocks == 1:
        yield from map(run, range(blocks))
        return
    with ThreadPoolExecutor(workers) as pool:
        waiting = [pool.submit(run, block) for block in range(min(workers, blocks))]
        for block in range(len(waiting), blocks + len(waiting)):
            first, *waiting = waiting
            if block < blocks:
                waiting.append(pool.submit(run, block))
            yield first.result()


class _Tally:
    """Counts that grow with the members while the memory does not."""

    def __init__(self, *, time_limit: float, quantiles: Sequence[float]) -> None:
        self.quantiles = quantiles
        self.members = self.settled = self.diverged = self.drifted = 0
        self.width = time_limit / TIME_BINS
        self.times = np.zeros(TIME_BINS, dtype=np.int64)
        self.overshoots, self.misadjustments = (np.zeros(MOST_COUNTED + 1, dtype=np.int64) for _ in range(2))

    def add(self, runs: MemberRuns) -> None:
        """Count the members of a block."""
        times = runs.settling_time[runs.settled]
        self.members += runs.settled.size
        self.settled += times.size
        self.diverged += int(runs.diverged.sum())
        self.drifted += int(runs.drifted.sum())
        bins = np.minimum((times / self.width).astype(np.int64), TIME_BINS - 1)
        self.times += np.bincount(bins, minlength=TIME_BINS)
        for counts, found in ((self.overshoots, runs.overshoots), (self.misadjustments, runs.misadjustments)):
            counts += np.bincount(np.minimum(found, MOST_COUNTED), minlength=MOST_COUNTED + 1)

    def ensemble(self, *, law: str, seed: int, uncertainty_95: MemberUncertainty) -> Ensemble:
        """Freeze the counts."""

        def share(count: int) -> Probability:
            return Probability.counted(count=count, of=self.members)

        return Ensemble(
            law=law,
            members=self.members,
            seed=seed,
            uncertainty_95=uncertainty_95,
            settled=share(self.settled),
            not_settled=share(self.members - self.settled),
            overshoot=share(self.members - int(self.overshoots[0])),
            misadjustment=share(self.members - int(self.misadjustments[0])),
            diverged=share(self.diverged),
            drifted=share(self.drifted),
            settling_quantiles=self._quantiles(),
            bin_width=self.width,
            time_counts=self.times,
            overshoot_counts=self.overshoots,
            misadjustment_counts=self.misadjustments,
        )

    def _quantiles(self) -> tuple[float | None, ...]:
        """End of the bin in which the last of that fraction of all members settled, s; None: fewer did."""
        reached = np.cumsum(self.times)
        needed = np.ceil(np.array(self.quantiles) * self.members - _ROUND_OFF)
        ends = self.width * (1.0 + np.searchsorted(reached, needed))
        return tuple(float(end) if n <= reached[-1] else None for end, n in zip(ends, needed, strict=True))
