"""What a wrong k and lambda do to a machine: one controller under the paper's law and the calibrated one."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.algorithm import Controller
from ringbalance.controller.algorithms.by_name import law_based_of, target_vector_of
from ringbalance.controller.document import simulation_document
from ringbalance.controller.ensemble import Ensemble, ensemble_dynamics, simulate_ensemble
from ringbalance.controller.liquid_ring.loop_factor import loop_factor
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Simulation
from ringbalance.controller.tuning.recommendation import recommended_gain
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.assumptions import KNOWN

SMALL_FILL: Final = 1e-3
"""Change of fill over which a loop counts as linear."""
CURVE_FACTORS: Final[FloatArray] = np.geomspace(0.25, 4.0, 21)
"""Of k, along the analytic curves."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _GainCurve:
    """Where overshoot and instability start, in controller.proportional, as one quantity varies."""

    values: FloatArray
    """Of the quantity, shape (n,)."""
    overshoot_gain: FloatArray
    """s/m."""
    instability_gain: FloatArray
    """s/m."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopGain:
    """The proportional loop about level chambers under one law."""

    law: str
    velocity: float
    """u at equal fills, m/s."""
    drag_coefficient: float
    """k that Eq. 18 reads out of that velocity, 2p/(rho u^2) - 1."""
    moment_per_transferred_mass: float
    """lambda at equal fills, m."""
    slope: float
    """Vibration taken away per second of gas, m/s."""
    gain: float
    """controller.proportional, s/m."""
    per_operation: float
    """h = Kc slope: share of the residual that an operation takes away."""
    lag_margin: float
    """Error of the assumed lag angle at which the residual no longer falls, acos(h/2), rad; 0 if h >= 2."""
    over_drag: _GainCurve

    @property
    def overshoot_gain(self) -> float:
        """Kc from which a small residual turns round, 1/slope, s/m."""
        return 1 / self.slope

    @property
    def instability_gain(self) -> float:
        """Kc from which a small residual grows, 2/slope, s/m."""
        return 2 / self.slope


def loop_gain(scene: Scene, model: BalancerModel) -> LoopGain | None:
    """Linearise the loop about level chambers.

    e_(n+1) = (1 - h) e_n with h = Kc dA/dt and dA/dt = kappa |dM/dx| u S/V, so a residual turns round from h
    = 1 and grows from h = 2. With k h varies as 1/sqrt(k + 1); for a law whose k depends on
    the velocity that is the curve for a constant k that gives the same velocity at equal fills.
    Returns: LoopGain; None when the gas does not drive a flow at equal fills.
    Source: sections 4.2 and 5 of the liquid-ring paper; a discrete first-order loop.
    """
    x, pressure = scene.disc.initial_fill, scene.gas.pressure
    flow = model.flow.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure)
    u = float(flow.velocity)
    if u <= 0 or pressure <= 0:
        return None
    per_fill = _moment_per_fill(scene, model)
    slope = scene.rotor.influence_coefficient * per_fill * u * model.tube_area / model.chamber_volume
    k = 2 * pressure / (model.density * u**2) - 1
    arm = per_fill / (model.density * model.chamber_volume)
    h = scene.controller.proportional * slope
    slowed = np.sqrt((k + 1) / (k * CURVE_FACTORS + 1))
    return LoopGain(
        law=model.name,
        velocity=u,
        drag_coefficient=k,
        moment_per_transferred_mass=arm,
        slope=slope,
        gain=scene.controller.proportional,
        per_operation=h,
        lag_margin=math.acos(min(h / 2, 1.0)),
        over_drag=_GainCurve(
            values=k * CURVE_FACTORS,
            overshoot_gain=1 / (slope * slowed),
            instability_gain=2 / (slope * slowed),
        ),
    )


def _moment_per_fill(scene: Scene, model: BalancerModel) -> float:
    """|dM/dx| at equal fills with the total held, kg m."""
    x, step = scene.disc.initial_fill, SMALL_FILL
    ends = np.array([x - step, x + step])
    moments = model.moment.pair_vector(fill_ratio=ends, opposite_fill_ratio=2 * x - ends)
    return float(abs(moments[1] - moments[0])) / (2 * step)


MEMBERS: Final = 2000
"""Of each ensemble at the light level."""
_DECIDING: Final = ("tube.bore", "tube.length", "tube.hump_radius", "rotor.influence_coefficient")
POINTS: Final = 50
"""Most entries of any array in the document."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One closed-loop run and what it stands for."""

    name: str
    """Short and unique: "paper", "calibrated", "calibrated_retuned", "law_based", "law_based_wrong_law"."""
    title: str
    """For readers."""
    controller: str
    """Algorithm and what it assumes."""
    proportional: float | None
    """Kc, s/m; None for an algorithm without a gain."""
    simulation: Simulation


@dataclass(frozen=True, kw_only=True, eq=False)
class Consequences:
    """The loop of one scene under two laws."""

    scene: str
    runs: tuple[Run, ...]
    gains: tuple[LoopGain, ...]
    """The paper's law, then the calibrated one; a law that does not flow at equal fills is missing."""
    retuned_proportional: float | None
    """Kc recommended for the calibrated law, s/m; None when nothing flows."""
    ensembles: tuple[Ensemble, ...]
    """The paper's law, the calibrated one, and the calibrated one with what is recommended."""
    notes: tuple[str, ...]
    """What could not be found, and why."""
    findings: tuple[str, ...]
    """One sentence each."""

    def document(self) -> dict[str, Any]:
        """All as plain numbers, lists and text in SI; arrays of at most 50 entries."""
        return {
            "scene": self.scene,
            "findings": list(self.findings),
            "notes": list(self.notes),
            "retuned_proportional_s_per_m": self.retuned_proportional,
            "runs": [_run_document(run) for run in self.runs],
            "gain": [_gain_document(gain) for gain in self.gains],
            "ensembles": [ensemble.document() for ensemble in self.ensembles],
        }


def find_consequences(
    scene: Scene,
    calibrated: BalancerModel,
    *,
    paper: BalancerModel | None = None,
    recommended: Scene | None = None,
    members: int = MEMBERS,
) -> Consequences:
    """Run a scene's target-vector controller under both laws, with its margins, re-tuned, and law-based.

    Args: `scene`: the scene; its controller's `kind` is not looked at. `paper`: by the paper's law; default
    `paper_model(scene)`. `recommended`: the scene as tuned; default with `recommended_gain`.
    Raises: SceneError: a rotor too slow to form a ring, or a model made for another disc.
    Source: sections 5 and 6 of the liquid-ring paper; the comparison is this program's.
    """
    nominal = paper_model(scene) if paper is None else paper
    notes = _assumed(scene)
    moving = {m.name: _dynamics(scene, m, notes) for m in (nominal, calibrated)}
    gains = {m.name: _gain(scene, m, moving[m.name], notes) for m in (nominal, calibrated)}
    tuned = recommended or _recommended(scene, calibrated)
    retuned = None if tuned is None else tuned.controller.proportional
    asked = [(scene, nominal), (scene, calibrated)] + ([(tuned, calibrated)] if tuned else [])
    ensembles = [
        simulate_ensemble(own, model, members, scene.run.seed, dynamics=dynamics)
        for own, model in asked
        if (dynamics := _on(own, scene, model, moving[model.name], notes)) is not None
    ]
    runs = _runs(scene, tuned, nominal, calibrated)
    return Consequences(
        scene=scene.name,
        runs=runs,
        gains=tuple(gain for gain in gains.values() if gain is not None),
        retuned_proportional=retuned,
        ensembles=tuple(ensembles),
        notes=tuple(notes),
        findings=_findings(gains[nominal.name], gains[calibrated.name], retuned, runs, tuple(ensembles)),
    )


def _assumed(scene: Scene) -> list[str]:
    """What k, lambda and the rate rest on that nobody gave."""
    found = [(path, scene.origin_of(path)) for path in _DECIDING]
    named = [f"{path} ({origin})" for path, origin in found if origin not in KNOWN]
    return [f"These results rest on inputs that nobody gave: {', '.join(named)}."] if named else []


def _on(
    own: Scene, scene: Scene, model: BalancerModel, dynamics: Dynamics | None, notes: list[str]
) -> Dynamics | None:
    """The dynamics of a scene, made again only where its gas is another one."""
    return dynamics if own.gas == scene.gas else _dynamics(own, model, notes)


def _dynamics(scene: Scene, model: BalancerModel, notes: list[str]) -> Dynamics | None:
    try:
        return ensemble_dynamics(scene, model)
    except ValueError as cause:
        notes.append(f"{model.name}: no margins and no ensemble; {cause}")
        return None


def _gain(scene: Scene, model: BalancerModel, dynamics: Dynamics | None, notes: list[str]) -> LoopGain | None:
    found = None if dynamics is None else loop_gain(scene, model)
    if found is None and dynamics is not None:
        notes.append(f"{model.name}: the gas drives no flow at equal fills, so the loop has no gain")
    return found


def _recommended(scene: Scene, model: BalancerModel) -> Scene | None:
    loop = loop_factor(scene, model, target_vector_of(scene))
    gain = recommended_gain(scene, model, loop=loop)
    return replace(scene, controller=replace(scene.controller, proportional=gain)) if gain else None


def _runs(
    scene: Scene, tuned: Scene | None, nominal: BalancerModel, calibrated: BalancerModel
) -> tuple[Run, ...]:
    def run(
        name: str, title: str, words: str, own: Scene, model: BalancerModel, controller: Controller[Any]
    ) -> Run:
        gain = own.controller.proportional if words.startswith("target") else None
        found = simulate(own, model, controller=controller)
        return Run(name=name, title=title, controller=words, proportional=gain, simulation=found)

    same, vector = target_vector_of(scene), "target vector"
    law = "law-based, assumes the calibrated law"
    wrong = "law-based, assumes the paper's law"
    runs = [
        run("paper", "the paper's law", vector, scene, nominal, same),
        run("calibrated", "the calibrated law, same controller", vector, scene, calibrated, same),
    ]
    if tuned is not None:
        title = "the calibrated law, recommended settings"
        runs.append(run("calibrated_retuned", title, vector, tuned, calibrated, target_vector_of(tuned)))
    title = "the calibrated law, no gain to tune"
    runs.append(run("law_based", title, law, scene, calibrated, law_based_of(scene, calibrated)))
    title = "the calibrated law, a controller with the paper's law"
    runs.append(run("law_based_wrong_law", title, wrong, scene, calibrated, law_based_of(scene, nominal)))
    return tuple(runs)


def _findings(
    nominal: LoopGain | None,
    calibrated: LoopGain | None,
    retuned: float | None,
    runs: tuple[Run, ...],
    ensembles: tuple[Ensemble, ...],
) -> tuple[str, ...]:
    told = []
    if nominal is not None and calibrated is not None:
        told += [
            f"A second of gas takes {calibrated.slope * 1e6:.3g} um away, not {nominal.slope * 1e6:.3g} um: "
            f"read through Eq. 18, k is {calibrated.drag_coefficient:.3g} at equal fills, not "
            f"{nominal.drag_coefficient:.3g}.",
            f"The same gain of {nominal.gain * 1e-6:.3g} s/um takes {calibrated.per_operation:.0%} of the "
            f"residual away in one operation, not {nominal.per_operation:.0%}: {_stability(calibrated)}.",
        ]
    if retuned is not None:
        told.append(f"Recommended for the calibrated law is a gain of {retuned * 1e-6:.3g} s/um.")
    told += [f"Run under {run.title}: {_ending(run.simulation)}." for run in runs]
    for ensemble, of in zip(ensembles, ("", "", " with the recommended settings"), strict=False):
        told.append(
            f"Of {ensemble.members} runs under the {ensemble.law} law{of}, {ensemble.overshoot.value:.1%} "
            "overshoot, "
            f"{ensemble.misadjustment.value:.1%} misadjust and {ensemble.not_settled.value:.1%} do not "
            "settle."
        )
    return tuple(told)


def _stability(gain: LoopGain) -> str:
    h = gain.per_operation
    if h >= 2:
        return "the residual grows"
    turns = f"it turns round each time, and from a gain {2 / h:.3g} times as large it grows"
    return turns if h > 1 else "it does not overshoot"


def _ending(simulation: Simulation) -> str:
    turns = f"{simulation.overshoots} overshoots, {simulation.misadjustments} misadjustments"
    if simulation.settling_time is None:
        return f"{simulation.verdict.value} ({simulation.outcome.value.replace('_', ' ')}), {turns}"
    return f"settled after {simulation.settling_time:.3g} s, {turns}"


def _run_document(run: Run) -> dict[str, Any]:
    simulation = run.simulation
    whole = simulation_document(simulation)
    closed = [i.time + i.duration for i in simulation.injections]
    end = min(float(simulation.time[-1]), 1.2 * max(closed, default=np.inf))
    known = np.flatnonzero(simulation.time <= end)
    shown = known[np.unique(np.linspace(0, known.size - 1, POINTS).round().astype(np.intp))]
    return {
        "name": run.name,
        "title": run.title,
        "controller": run.controller,
        "proportional_s_per_m": run.proportional,
        "law": simulation.law,
        "settled": simulation.settled,
        "settling_time_s": simulation.settling_time,
        "verdict": simulation.verdict.value,
        "outcome": simulation.outcome.value,
        "loop_factor": simulation.loop.value,
        "stationary_deviation_m": whole["stationary_deviation_m"],
        "status": simulation.status,
        "overshoots": simulation.overshoots,
        "misadjustments": simulation.misadjustments,
        "operations": len({injection.time for injection in simulation.injections}),
        "injections": len(simulation.injections),
        "gas": whole.get("gas"),
        "gas_time_s": float(sum(i.duration for i in simulation.injections)),
        "limit_m": simulation.limit,
        "time_s": simulation.time[shown].tolist(),
        "amplitude_m": simulation.amplitude[shown].tolist(),
    }


def _gain_document(gain: LoopGain) -> dict[str, Any]:
    curve = {
        name: [float(v) if np.isfinite(v) else None for v in values]
        for name, values in vars(gain.over_drag).items()
    }
    return {
        "law": gain.law,
        "velocity_m_s": gain.velocity,
        "drag_coefficient": gain.drag_coefficient,
        "moment_per_transferred_mass_m": gain.moment_per_transferred_mass,
        "slope_m_per_s": gain.slope,
        "proportional_s_per_m": gain.gain,
        "gain_per_operation": gain.per_operation,
        "overshoot_proportional_s_per_m": gain.overshoot_gain,
        "instability_proportional_s_per_m": gain.instability_gain,
        "margin_to_overshoot": 1 / gain.per_operation,
        "margin_to_instability": 2 / gain.per_operation,
        "lag_margin_rad": gain.lag_margin,
        "over_drag_coefficient": curve,
    }
