"""Tuning of a liquid ring's controller: its gain, margins, smallest correction and settling times."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.by_name import controller_of, target_vector_of
from ringbalance.controller.checks import check_settings
from ringbalance.controller.ensemble.monte_carlo import Probability, binomial_share, simulate_ensemble
from ringbalance.controller.ensemble.samples import MemberUncertainty, drawn_members
from ringbalance.controller.loop import simulate
from ringbalance.controller.terms import run_models, terms_modelled
from ringbalance.controller.tuning.loop_factor import LoopFactor, loop_factor, vibration_rates
from ringbalance.controller.tuning.margins import Margins, loop_margins
from ringbalance.controller.tuning.recommendation import (
    Contribution,
    FactorUncertainty,
    factor_uncertainty,
    recommended_gain,
)
from ringbalance.reduced_model.chamber.gravity import check_ring
from ringbalance.reduced_model.gas_line import LineAnswer, line_answers, line_document
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.selection.registry import ModelUsed
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

Progress = Callable[[str], None]

MEMBERS: Final = 2000
"""Compiled runs of the target-vector algorithm."""
MOVING_MEMBERS: Final = 200
"""The most of them where inertia, gas or valves are modelled, which takes a hundred times as long."""
RUNS: Final = 20
"""Runs one by one, of an algorithm that is not compiled."""
QUANTILES: Final = {"p50": 0.5, "p95": 0.95}


@dataclass(frozen=True, kw_only=True)
class SettlingTimes:
    """Settling under the recommended gain, over the uncertainty and the noise."""

    runs: int
    settled: Probability
    """Within the scene's time limit."""
    quantiles: dict[str, float | None]
    """s, by which that fraction of all runs has settled; None: fewer have."""


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """What is recommended for a scene's controller under a law."""

    scene: Scene
    law: str
    gain: float | None
    """Kc, s/m; None for an algorithm without a gain, and where no gain reaches the limit."""
    present: LoopFactor
    """With the scene's own gain."""
    loop: LoopFactor
    """With the recommended one."""
    margins: Margins | None
    contributions: tuple[Contribution, ...]
    first_gas_time: float | None
    """s, of the vector, for the initial vibration."""
    last_gas_time: float | None
    """s, for an amplitude at the limit."""
    smallest_correction: float
    """Change of the vibration by the shortest valve-open time in the fastest chamber, m."""
    dead_zone: float
    """Largest amplitude at which no valve may open any more, m."""
    reachable: bool | None
    """Whether valves and gas line can bring the amplitude below the limit; None: the line is not known."""
    gas_line: tuple[LineAnswer, ...]
    """What the gas line can deliver, or both ends of a default range of lines."""
    settling: SettlingTimes | None
    models_used: tuple[ModelUsed, ...]
    status: str

    @property
    def succeeded(self) -> bool:
        """Whether 95 % of the runs settle in time, and nothing that is known stands against it."""
        reached = self.settling is not None and self.settling.quantiles["p95"] is not None
        return reached and self.reachable is not False


def tune(
    scene: Scene,
    model: BalancerModel,
    *,
    members: int = MEMBERS,
    runs: int = RUNS,
    progress: Progress | None = None,
) -> Tuning:
    """Recommend a gain: the largest with which no residual turns round at the edge of the uncertainty.

    The law-based algorithm has no gain: its loop factor is one, whatever the flow, and the same margins and
    settling times are given for it.
    Raises: SceneError: settings without a meaning, or a rotor too slow to form a ring.
    """
    told = progress or _silent
    check_settings(scene)
    check_ring(scene)
    told("uncertainty ...")
    known = factor_uncertainty(scene, model)
    widths = known.widths
    present = loop_factor(scene, model, controller_of(scene, model))
    wanted = recommended_gain(
        scene, model, loop=loop_factor(scene, model, target_vector_of(scene)), uncertainty=known
    )
    has_gain = scene.controller.kind != "law_based"
    tuned = _with_gain(scene, wanted) if has_gain and wanted > 0 else scene
    loop = loop_factor(tuned, model, controller_of(tuned, model))
    smallest = float(np.max(vibration_rates(scene, model))) * scene.controller.minimum_gas_time
    dead = _dead_zone(tuned, smallest)
    lines = line_answers(scene, model)
    within = wanted > 0 and loop.stays and max(dead, smallest / 2) <= scene.controller.limit
    told("settling times ...")
    settling = _settling(tuned, model, widths, members=members, runs=runs, told=told) if wanted > 0 else None
    amplitude, limit = scene.rotor.initial_amplitude, scene.controller.limit
    return Tuning(
        scene=tuned,
        law=model.name,
        gain=wanted if has_gain and wanted > 0 else None,
        present=present,
        loop=loop,
        margins=_margins(tuned, loop, known) if wanted > 0 else None,
        contributions=known.parts,
        first_gas_time=min(wanted * amplitude, scene.controller.maximum_gas_time) if wanted > 0 else None,
        last_gas_time=wanted * limit if wanted > 0 else None,
        smallest_correction=smallest,
        dead_zone=dead,
        reachable=within and _line_reaches(lines),
        gas_line=lines,
        settling=settling,
        models_used=run_models(scene=scene, model=model),
        status=_status(tuned, loop, dead=dead, smallest=smallest, settling=settling, flows=present.rate > 0),
    )


def _line_reaches(lines: tuple[LineAnswer, ...]) -> bool | None:
    """Whether a given line can; of a default range: True when all can, None when that is not sure."""
    above = [answer.above_limit for answer in lines]
    if not any(above):
        return True
    return False if all(answer.end == "given" for answer in lines) else None


def _silent(_: str) -> None:
    """No progress wanted."""


def _with_gain(scene: Scene, gain: float) -> Scene:
    settings = replace(scene.controller, proportional=gain)
    return replace(scene, controller=replace(settings, kind="target_vector"))


def _margins(scene: Scene, loop: LoopFactor, known: FactorUncertainty) -> Margins:
    settings = scene.controller
    error = abs(settings.assumed_lag_angle - scene.rotor.lag_angle)
    fixed = settings.kind != "law_based"
    return loop_margins(
        loop_factor=loop.value if fixed and loop.value else 1.0,
        gain_uncertainty=known.total,
        phase_uncertainty=known.widths.lag_angle + error,
        integral=settings.period / (settings.integral_time or math.inf) if fixed else 0.0,
        derivative=settings.derivative_time / settings.period if fixed else 0.0,
    )


def _dead_zone(scene: Scene, smallest: float) -> float:
    """Amplitude below which both shares of a vector may be shorter than the valves' minimum, m."""
    chambers, settings = scene.disc.chambers, scene.controller
    apart = 1.0 if chambers == 2 else 2.0 * math.cos(math.pi / chambers)
    if settings.kind == "law_based":
        return apart * smallest
    return apart * settings.minimum_gas_time / settings.proportional


def _settling(
    scene: Scene, model: BalancerModel, widths: MemberUncertainty, *, members: int, runs: int, told: Progress
) -> SettlingTimes:
    if scene.controller.kind == "target_vector":
        carried = terms_modelled(run_models(scene=scene, model=model))
        members = min(members, MOVING_MEMBERS) if carried else members
        return _of_ensemble(scene, model, widths, members=members, told=told)
    times = np.array([_one_run(scene, model, widths, number=i, told=told) for i in range(runs)])
    return SettlingTimes(
        runs=runs,
        settled=binomial_share(count=int(np.isfinite(times).sum()), of=runs),
        quantiles={name: _quantile(times, q) for name, q in QUANTILES.items()},
    )


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
    asked = replace(scene, rotor=rotor, run=replace(scene.run, seed=scene.run.seed + number))
    time = simulate(asked, model).settling_time
    return math.inf if time is None else time


def _quantile(times: FloatArray, q: float) -> float | None:
    found = float(np.quantile(times, q, method="inverted_cdf"))
    return found if math.isfinite(found) else None


def _status(
    scene: Scene,
    loop: LoopFactor,
    *,
    dead: float,
    smallest: float,
    settling: SettlingTimes | None,
    flows: bool,
) -> str:
    limit, um = scene.controller.limit, 1e6
    if not flows:
        return "no gain: the gas drives no liquid at the balanced fills: raise gas.pressure"
    if settling is None or not loop.stays:
        return (
            f"no gain keeps the amplitude within {limit * um:.4g} um: the sensor's noise is "
            f"{scene.sensor.amplitude_noise * um:.4g} um: raise controller.limit or average the sensor"
        )
    if max(dead, smallest / 2) > limit:
        return (
            f"the valve is too slow for the limit of {limit * um:.4g} um: the shortest valve-open time moves "
            f"the vibration by {smallest * um:.4g} um, and up to {dead * um:.4g} um no valve opens: lower "
            "controller.minimum_gas_time or raise controller.limit"
        )
    reached = settling.quantiles["p95"]
    if reached is None:
        return (
            f"{settling.settled.value:.1%} of the runs settle within the time limit of "
            f"{scene.run.time_limit:.4g} s: 95 % is not reached"
        )
    return f"tuned: 95 % of the runs settle within {reached:.3g} s"


def tuning_document(tuning: Tuning) -> dict[str, Any]:
    """A tuning as a JSON document in SI; null: there is none, or a quantile is not reached."""
    loop, margins, settling, scene = tuning.loop, tuning.margins, tuning.settling, tuning.scene
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": scene.balancer,
        "law": tuning.law,
        "controller": scene.controller.kind,
        "status": tuning.status,
        "gain": tuning.gain,
        "loop_factor": loop.value,
        "loop_factor_limit": loop.limit,
        "present": {"loop_factor": tuning.present.value, "unstable": tuning.present.unstable},
        "vibration_rate_m_per_s": loop.rate,
        "stationary_deviation_m": _finite(loop.deviation),
        "margins": None
        if margins is None
        else {name: _finite(value) for name, value in asdict(margins).items()}
        | {"left_gain_factor": margins.left_gain_factor, "left_phase": margins.left_phase},
        "uncertainty": [asdict(part) for part in tuning.contributions],
        "first_gas_time_s": tuning.first_gas_time,
        "last_gas_time_s": tuning.last_gas_time,
        "minimum_gas_time_s": scene.controller.minimum_gas_time,
        "smallest_correction_m": tuning.smallest_correction,
        "dead_zone_m": tuning.dead_zone,
        "limit_m": scene.controller.limit,
        "reachable": tuning.reachable,
        "gas_line": line_document(tuning.gas_line),
        "settling_time_s": None if settling is None else settling.quantiles,
        "fraction_settled": None if settling is None else settling.settled.value,
        "fraction_settled_95": None if settling is None else [settling.settled.low, settling.settled.high],
        "runs": 0 if settling is None else settling.runs,
        "left_out": [],
        "models_used": [asdict(used) for used in tuning.models_used],
    }


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
