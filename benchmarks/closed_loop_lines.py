"""The comparisons of the closed-loop benchmark: each thing by this program and by its rival."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from closed_loop_plain import Plain, plain_run

from ringbalance.controller.ensemble import (
    EnsemblePlan,
    ensemble_dynamics,
    simulate_ensemble,
    simulate_members,
)
from ringbalance.controller.loop import simulate
from ringbalance.controller.members import Members
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.scene.models import Scene
from ringbalance.verification.reference.transfers import Drive, closed_form

FILL_ERROR = 1e-6
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
BATCH = 10_000
PLAIN_RUNS = 3

Rivals = dict[str, Plain]


class Seconds(NamedTuple):
    """What one call takes."""

    wall: float
    processor: float
    """Of all threads."""

    def per(self, count: int) -> Seconds:
        """A share of it. Args: `count`: how many things one call does."""
        return Seconds(self.wall / count, self.processor / count)


@dataclass(frozen=True, kw_only=True)
class Line:
    """One comparison."""

    what: str
    ours: Seconds
    rival: Seconds
    wanted: float | None
    """Ratio asked for; None: told for completeness."""

    @property
    def ratio(self) -> float:
        """How many times faster ours is by the clock on the wall."""
        return self.rival.wall / self.ours.wall

    @property
    def processor_ratio(self) -> float:
        """How many times less processor time ours takes, all cores together."""
        return self.rival.processor / self.ours.processor


def least_seconds(action: Callable[[], object], repeats: int, inner: int = 1) -> Seconds:
    """Least time of one call, which other work on the machine disturbs least.

    Args: `action`: what to time. `repeats`: rounds, after one that warms caches. `inner`: calls in a round.
    """
    action()
    rounds = []
    for _ in range(repeats):
        start, used = time.perf_counter(), time.process_time()
        for _ in range(inner):
            action()
        rounds.append(Seconds(time.perf_counter() - start, time.process_time() - used).per(inner))
    return Seconds(min(r.wall for r in rounds), min(r.processor for r in rounds))


def drives_of(scene: Scene, model: BalancerModel) -> list[tuple[Drive, float]]:
    """Operations to judge a tolerance by: a usual one, and a long one from a full chamber.

    Returns: Drives with their valve-open times, s.
    """
    rate, total = model.tube_area / model.chamber_volume, 2 * scene.disc.initial_fill
    return [
        (
            Drive(
                law=model.flow,
                fill=x,
                total=total,
                exchange_rate=rate,
                gas_pressure=scene.gas.pressure,
                primed=False,
            ),
            duration,
        )
        for x, duration in ((total / 2, 0.6), (0.8 * total, 0.9))
    ]


def loosest(scene: Scene, model: BalancerModel, velocity: Callable[[float], float]) -> Plain:
    """The rival with the loosest tolerance whose fills are right to `FILL_ERROR`.

    Args: `velocity`: its right-hand side.
    Raises: RuntimeError: no tolerance reaches it.
    """
    drives = drives_of(scene, model)
    exact = [closed_form(drive, np.array([t])).fill[-1] for drive, t in drives]
    for tolerance in TOLERANCES:
        plain = Plain(
            velocity=velocity,
            rate=drives[0][0].exchange_rate,
            total=2 * scene.disc.initial_fill,
            tolerance=tolerance,
        )
        found = [plain.operate(drive.fill, t) for drive, t in drives]
        if max(abs(a - b) for a, b in zip(found, exact, strict=True)) <= FILL_ERROR:
            return plain
    raise RuntimeError("solve_ivp does not reach the error asked for")


def run_lines(scene: Scene, model: BalancerModel, rivals: Rivals, repeats: int) -> list[Line]:
    """A whole run with an exact sensor: of an ensemble of one, and by `simulate` with its record.

    Args: `rivals`: by name. `repeats`: timed rounds.
    Returns: Three lines for each rival.
    """
    still = replace(scene, sensor=replace(scene.sensor, amplitude_noise=0.0, phase_noise=0.0))
    plan = EnsemblePlan.of(scene=still, model=model, dynamics=ensemble_dynamics(still, model))
    alone = Members.alike(still, size=1)
    ours = (
        ("a whole run", least_seconds(lambda: plan.run(alone, seed=0), repeats, 20), 20),
        (
            "a whole run, preparation and all",
            least_seconds(lambda: simulate_members(still, model), repeats, 5),
            None,
        ),
        ("a whole run by simulate", least_seconds(lambda: simulate(still, model), repeats), None),
    )
    lines = []
    for name, plain in rivals.items():
        check_same(still, model, plain)
        rival = least_seconds(partial(plain_run, still, model, plain, 0), repeats)
        lines += [
            Line(what=f"{name}: {what}", ours=own, rival=rival, wanted=wanted) for what, own, wanted in ours
        ]
    return lines


def plain_runs(scene: Scene, model: BalancerModel, plain: Plain) -> None:
    """Some noisy runs of the rival."""
    for seed in range(PLAIN_RUNS):
        plain_run(scene, model, plain, seed)


def ensemble_lines(
    scene: Scene, model: BalancerModel, rivals: Rivals, members: int, repeats: int
) -> list[Line]:
    """A noisy run among many, against a noisy run alone.

    Args: `rivals`: by name. `repeats`: timed rounds.
    Returns: A line for each rival.
    """
    simulate_ensemble(scene, model, 1, 0)
    ours = least_seconds(lambda: simulate_ensemble(scene, model, members, 0), repeats).per(members)
    lines = []
    for name, plain in rivals.items():
        rival = least_seconds(partial(plain_runs, scene, model, plain), repeats)
        lines.append(
            Line(
                what=f"{name}: a noisy run among {members}",
                ours=ours,
                rival=rival.per(PLAIN_RUNS),
                wanted=1000,
            )
        )
    return lines


def check_same(scene: Scene, model: BalancerModel, plain: Plain) -> None:
    """Make sure that all sides do the same work.

    Args: `scene`: with an exact sensor. `plain`: the rival.
    Raises: RuntimeError: they do not end alike.
    """
    ours, quick = simulate(scene, model), simulate_members(scene, model)
    end, samples = plain_run(scene, model, plain, 0)
    # A fill of 1e-6 in each operation is some 1e-9 m.
    if samples != len(ours.samples) or abs(abs(end) - ours.amplitude[-1]) > 1e-9:
        raise RuntimeError("the plain loop and simulate do not do the same")
    if samples != quick.samples[0] or abs(abs(end) - quick.final_amplitude[0]) > 1e-9:
        raise RuntimeError("the plain loop and an ensemble's member do not do the same")
