"""Settling times of a scene's closed loop over the uncertainty and the noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.controller.ensemble.monte_carlo import Probability, binomial_share, simulate_ensemble
from ringbalance.controller.ensemble.samples import MemberUncertainty, drawn_members
from ringbalance.controller.loop import simulate
from ringbalance.controller.terms import run_models, terms_modelled
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

Progress = Callable[[str], None]

MEMBERS: Final = 2000
"""Compiled runs of the target-vector algorithm."""
MOVING_MEMBERS: Final = 200
"""The most of them where inertia, gas or valves are modelled, which takes a hundred times as long."""
FIRST_MEMBERS: Final = 16
"""Of these come first; more only where their 95 % interval leaves it open that 95 % of them settle."""
RUNS: Final = 20
"""Runs one by one, of an algorithm that is not compiled."""
FIRST_RUNS: Final = 4
QUANTILES: Final = {"p50": 0.5, "p95": 0.95}
_TRIED_SAMPLES: Final = 40
"""Commands after which a change that helps has settled the loop: three take a tenth of the way each."""


@dataclass(frozen=True, kw_only=True)
class SettlingTimes:
    """Settling under the recommended settings, over the uncertainty and the noise."""

    runs: int
    settled: Probability
    """Within the scene's time limit."""
    quantiles: dict[str, float | None]
    """s, by which that fraction of all runs has settled; None: fewer have."""

    def rows(self, limit: float) -> dict[str, str]:
        """As a person reads them; `limit` is the time that each run had, s."""
        times = ", ".join(
            f"{name[1:]} % within {f'{time:.3g} s' if time is not None else 'not reached'}"
            for name, time in self.quantiles.items()
        )
        fraction = f"{self.settled.value:.2%} of {self.runs} runs within {limit:.4g} s"
        return {"settling time": times, "settled": fraction}


def settling_times(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, members: int, runs: int, told: Progress
) -> SettlingTimes:
    """Few runs first, and more where these leave it open that 95 % settle.

    Args: `members`: the most of compiled runs. `runs`: the most of others.
    """
    compiled = scene.controller.kind == "target_vector"
    moving = bool(terms_modelled(run_models(scene=scene, model=model)))
    most = min(members, MOVING_MEMBERS if moving else members) if compiled else runs
    first = (FIRST_MEMBERS if moving else most) if compiled else FIRST_RUNS
    found = _runs(scene, model, widths, number=min(first, most), told=told)
    if first >= most or found.settled.high < QUANTILES["p95"]:
        return found
    return _runs(scene, model, widths, number=most, told=told)


def tried(scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, told: Progress) -> SettlingTimes:
    """A few runs, in time for some tens of commands, whatever the scene's time limit."""
    settings = scene.controller
    command = settings.period + settings.minimum_gas_time + max(settings.offsets(scene.disc.chambers))
    first = min(settings.proportional * scene.rotor.initial_amplitude, settings.maximum_gas_time)
    span = settings.hold_time + 2 * first + _TRIED_SAMPLES * command
    short = replace(scene, run=replace(scene.run, time_limit=span))
    few = FIRST_MEMBERS // 2 if settings.kind == "target_vector" else FIRST_RUNS // 2
    return _runs(short, model, widths, number=few, told=told)


def _runs(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, number: int, told: Progress
) -> SettlingTimes:
    if scene.controller.kind == "target_vector":
        return _of_ensemble(scene, model, widths, members=number, told=told)
    return summary([_one_run(scene, model, widths, number=i, told=told) for i in range(number)])


def summary(times: Sequence[float]) -> SettlingTimes:
    """Of runs one by one, each with its settling time, s, or infinity; quantiles are of all of them."""
    settled = binomial_share(count=sum(map(math.isfinite, times)), of=len(times))
    quantiles = {name: _quantile(np.array(times), q) for name, q in QUANTILES.items()}
    return SettlingTimes(runs=len(times), settled=settled, quantiles=quantiles)


def _of_ensemble(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, members: int, told: Progress
) -> SettlingTimes:
    found = simulate_ensemble(
        scene,
        model,
        members,
        scene.run.seed,
        uncertainty_95=widths,
        quantiles=tuple(QUANTILES.values()),
        progress=lambda done, of: told(f"{done} of {of} runs"),
    )
    return SettlingTimes(
        runs=members,
        settled=found.settled,
        quantiles=dict(zip(QUANTILES, found.settling_quantiles, strict=True)),
    )


def _one_run(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, number: int, told: Progress
) -> float:
    """Settling time of one drawn run, s; infinite when it does not settle.

    Velocity, moment and influence coefficient act through their product, which is put into the last.
    """
    told(f"run {number + 1}")
    drawn = drawn_members(scene, uncertainty_95=widths, seed=scene.run.seed, block=0)
    factor = drawn.velocity_factor[number] * drawn.moment_factor[number]
    rotor = replace(
        scene.rotor,
        influence_coefficient=float(drawn.influence_coefficient[number] * factor),
        lag_angle=float(drawn.lag_angle[number]),
    )
    run = replace(scene.run, seed=scene.run.seed + number)
    asked = replace(scene, rotor=rotor, gas=drawn.gas_of(scene.gas, number), run=run)
    time = simulate(asked, model).settling_time
    return math.inf if time is None else time


def _quantile(times: FloatArray, q: float) -> float | None:
    found = float(np.quantile(times, q, method="inverted_cdf"))
    return found if math.isfinite(found) else None
