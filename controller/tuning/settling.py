"""Settling times of a scene's closed loop over the uncertainty and the noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ringbalance.controller.algorithms.by_name import controller_of, law_based_of
from ringbalance.controller.ensemble import Probability, simulate_ensemble
from ringbalance.controller.liquid_ring.loop_factor import usable_fill, with_driving_gas
from ringbalance.controller.loop import simulate
from ringbalance.controller.members import Members, MemberUncertainty
from ringbalance.controller.simulation import Simulation
from ringbalance.controller.terms import run_models, terms_modelled
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import Holding, stalled_fill_ratio
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.loop_models import Rotor
from ringbalance.scene.models import Scene

Progress = Callable[[str], None]

MEMBERS: Final = 2000
"""Runs of the target-vector algorithm."""
MOVING_MEMBERS: Final = 200
"""The most of them where inertia, gas or valves are modelled, which takes a hundred times as long."""
FIRST_MEMBERS: Final = 16
"""Of these come first; more only where their 95 % interval leaves it open that 95 % of them settle."""
RUNS: Final = 20
"""Of another algorithm."""
FIRST_RUNS: Final = 4
TOO_MANY: Final = 0.05
"""Fraction of the runs that is kept from settling for one reason, beyond which 95 % cannot settle."""
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
    drifted: float = 0.0
    """Fraction that has not settled, and in which liquid ran back with the gas off."""
    beyond_capacity: float = 0.0
    """Fraction in which the liquid at its best leaves more than the limit; looked for where p95 is None."""
    beyond_pressure: float = 0.0
    """The same with the fills to which the scene's gas drives the liquid."""

    let_go: Finding | None = None
    """Why the tube lets the corrections go that these runs make; empty where it holds them."""

    def explained_by(self, fraction: float) -> bool:
        """Whether a fraction of the runs is most of those that do not settle."""
        return fraction > 0.0 and fraction >= (1.0 - self.settled.value) / 2.0

    @property
    def out_of_capacity(self) -> bool:
        """Whether the disc's capacity alone keeps 95 % from settling, and little else does."""
        return self.beyond_capacity > TOO_MANY and self.explained_by(self.beyond_capacity)

    def told(self, fraction: float) -> str:
        """A fraction of the runs as their number, which claims nothing finer."""
        return f"{round(fraction * self.runs)} of {self.runs} runs"

    def quantities(self) -> tuple[Quantity, ...]:
        """The fraction of runs that settle with its interval, and when half and 95 % have."""
        names = {"p50": "50 % of runs settle within", "p95": "95 % of runs settle within"}
        times = (
            Quantity(
                key=f"settling_time_{name}",
                name=names[name],
                unit="s",
                value=time,
                origin="simulated",
                status="ok" if time is not None else "not_reached",
                digits=3,
            )
            for name, time in self.quantiles.items()
        )
        fraction = Quantity(
            key="fraction_settled",
            name="fraction of runs that settle",
            value=self.settled.value,
            lower=self.settled.low,
            upper=self.settled.high,
            origin="simulated",
        )
        return (*times, fraction, Quantity(key="runs", name="runs", value=self.runs, origin="simulated"))


def settling_times(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, members: int, runs: int, told: Progress
) -> SettlingTimes:
    """`many_runs`, and what keeps them from settling where 95 % do not."""
    found = many_runs(scene, model, widths, members=members, runs=runs, told=told)
    if found.quantiles["p95"] is not None:
        return found
    beyond, driven = _beyond_capacity(scene, model, widths, runs=found.runs)
    largest = 2 * scene.disc.initial_fill - usable_fill(scene, model)
    let_go = Holding.of(scene, fill_ratio=largest).finding if found.explained_by(found.drifted) else None
    return replace(found, beyond_capacity=beyond, beyond_pressure=driven, let_go=let_go)


def many_runs(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, members: int, runs: int, told: Progress
) -> SettlingTimes:
    """Few runs first, and more where these leave it open that 95 % settle.

    Args: `members`: the most of the target-vector algorithm. `runs`: the most of others.
    """
    vector = scene.controller.kind == "target_vector"
    moving = bool(terms_modelled(run_models(scene=scene, model=model)))
    most = min(members, MOVING_MEMBERS if moving else members) if vector else runs
    first = (FIRST_MEMBERS if moving else most) if vector else FIRST_RUNS
    found = _runs(scene, model, widths, number=min(first, most), told=told)
    if first < most and found.settled.high >= QUANTILES["p95"]:
        return _runs(scene, model, widths, number=most, told=told)
    return found


def tried(scene: Scene, model: BalancerModel, widths: MemberUncertainty) -> SettlingTimes:
    """A few runs, in time for some tens of commands, whatever the scene's time limit."""
    settings = scene.controller
    command = settings.period + settings.minimum_gas_time + max(settings.offsets(scene.disc.chambers))
    first = min(settings.proportional * scene.rotor.initial_amplitude, settings.maximum_gas_time)
    span = settings.hold_time + 2 * first + _TRIED_SAMPLES * command
    short = replace(scene, run=replace(scene.run, time_limit=span))
    few = FIRST_MEMBERS // 2 if settings.kind == "target_vector" else FIRST_RUNS // 2
    return _runs(short, model, widths, number=few, told=lambda _: None)


def _runs(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, number: int, told: Progress
) -> SettlingTimes:
    found = simulate_ensemble(
        scene,
        model,
        number,
        scene.run.seed,
        uncertainty_95=widths,
        controller=controller_of(scene, model),
        quantiles=tuple(QUANTILES.values()),
        progress=lambda done, of: told(f"{done} of {of} runs"),
    )
    return SettlingTimes(
        runs=number,
        settled=found.settled,
        quantiles=dict(zip(QUANTILES, found.settling_quantiles, strict=True)),
        drifted=found.drifted.value,
    )


def summary(times: Sequence[float]) -> SettlingTimes:
    """Of runs one by one, each with its settling time, s, or infinity; quantiles are of all of them."""
    settled = Probability.counted(count=sum(map(math.isfinite, times)), of=len(times))
    quantiles = {name: _quantile(np.array(times), q) for name, q in QUANTILES.items()}
    return SettlingTimes(runs=len(times), settled=settled, quantiles=quantiles)


def _beyond_capacity(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, runs: int
) -> tuple[float, float]:
    """Of the drawn runs, the fraction whose unbalance is beyond the liquid, and beyond it under this gas."""
    ring = law_based_of(scene, model).ring
    drawn = Members.drawn(scene, uncertainty_95=widths, seed=scene.run.seed, block=0)
    stalled = stalled_fill_ratio(
        law=model.flow, total=2 * scene.disc.initial_fill, gas_pressure=scene.gas.pressure
    )

    def fraction(asked: Scene, at_least: float) -> float:
        residual = drawn.at(slice(runs)).residual_fill(asked, law=model.flow)
        left = (
            ring.unreachable_vibration(
                rotor=_rotor(scene, drawn, number), least_fill=max(float(fill), at_least)
            )
            for number, fill in enumerate(residual)
        )
        return sum(vibration > scene.controller.limit for vibration in left) / runs

    return fraction(with_driving_gas(scene, model), 0.0), fraction(scene, stalled)


def _rotor(scene: Scene, drawn: Members, number: int) -> Rotor:
    """Of one drawn run; its balancing moment acts through the product, which is put into the coefficient."""
    coefficient = drawn.influence_coefficient[number] * drawn.moment_factor[number]
    return replace(
        scene.rotor,
        influence_coefficient=float(coefficient),
        lag_angle=float(drawn.lag_angle[number]),
    )


def drawn_run(scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, number: int) -> Simulation:
    """The run of a device by its number; velocity, moment and influence coefficient act through their
    product."""
    drawn = Members.drawn(scene, uncertainty_95=widths, seed=scene.run.seed, block=0)
    rotor = _rotor(scene, drawn, number)
    faster = rotor.influence_coefficient * float(drawn.velocity_factor[number])
    run = replace(scene.run, seed=scene.run.seed + number)
    gas, rotor = drawn.gas_of(scene.gas, number), replace(rotor, influence_coefficient=faster)
    (residual,) = drawn.at([number]).residual_fill(scene, law=model.flow)
    asked = replace(scene, rotor=rotor, gas=gas, run=run)
    return simulate(asked, model, residual_fill=float(residual))


def _quantile(times: FloatArray, q: float) -> float | None:
    found = float(np.quantile(times, q, method="inverted_cdf"))
    return found if math.isfinite(found) else None
