"""Two balancers side by side on one rotor, both tuned: time, residual, energy and the worst amplitude."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Final

import numpy as np

from ringbalance.controller import deferred
from ringbalance.controller.compare_rotor import OneRotor, own_scene
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.sampled_loops import advised
from ringbalance.controller.loop import simulate
from ringbalance.controller.rotor import chamber_letters
from ringbalance.controller.tuning.recommendation import factor_uncertainty
from ringbalance.controller.tuning.search import recommended
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.selection.registry import ModelUsed
from ringbalance.results.result import CommandResult
from ringbalance.scene.arrays import finite
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.loop_models import ControllerSettings
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene

_ModelOf = Callable[[Scene], BalancerModel]
"""Makes the model of a liquid ring from its scene on the common rotor."""
RUNS: Final = 5
"""Of each balancer, with the seeds that follow its scene's."""


@dataclass(frozen=True, kw_only=True)
class Result:
    """What one run of a balancer comes to, over the common span."""

    time: float
    """s, from the start of balancing until the amplitude has settled; infinite when it has not."""
    residual_ratio: float
    """Amplitude at the end over the one before balancing."""
    energy: float
    """What the balancer took, J: compressing the gas that it used, or the motors' electrical energy."""
    worst_amplitude: float
    """Largest amplitude from the start of balancing on, m zero-to-peak."""
    status: str
    """How the run ended and what to do next."""


@dataclass(frozen=True, kw_only=True)
class Side:
    """One balancer of a comparison."""

    scene: AnyScene
    """As it was run, on the common rotor and tuned, with the seed of the first run."""
    tuned: Mapping[str, float]
    """Scene keys that tuning has changed, with their values, SI."""
    results: tuple[Result, ...]
    """One for each seed."""
    models_used: tuple[ModelUsed, ...] = ()
    """Of a liquid ring: every physical term, with its model and its estimated contribution."""

    @property
    def settled(self) -> bool:
        """Whether every run settled."""
        return all(math.isfinite(result.time) for result in self.results)

    @property
    def time(self) -> float | None:
        """Median of all runs, s; None when fewer than half settled."""
        return finite(self.middle("time"))

    @property
    def status(self) -> str:
        """Of the first run that did not settle, else of the first."""
        return next((r for r in self.results if math.isinf(r.time)), self.results[0]).status

    def middle(self, name: str) -> float:
        """Median of one number of `Result` over the runs."""
        return float(np.quantile(self._values(name), 0.5, method="inverted_cdf"))

    def ends(self, name: str) -> tuple[float, float]:
        """Smallest and largest of one number of `Result` over the runs."""
        values = self._values(name)
        return min(values), max(values)

    def _values(self, name: str) -> list[float]:
        return [getattr(result, name) for result in self.results]


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison(CommandResult):
    """Two balancers on one rotor."""

    _deferred: ClassVar[Any] = deferred
    _summary: ClassVar[str] = "comparison_lines"

    rotor: OneRotor
    """That of the first scene."""
    span: float
    """s, from the start of balancing, of every run: the longer time limit of both scenes."""
    sides: tuple[Side, Side]
    """In the order of the scenes."""

    def to_dict(self) -> dict[str, Any]:
        """See `document`."""
        return self.document()

    def document(self) -> dict[str, Any]:
        """All as a JSON document in SI; lists run along `scenes`; null: not settled."""
        sides, rotor = self.sides, self.rotor
        return {
            "scenes": [
                {"name": side.scene.name, "source": side.scene.source, "sha256": side.scene.sha256}
                for side in sides
            ],
            "balancer": [side.scene.balancer for side in sides],
            "settled": [side.settled for side in sides],
            "time_s": [side.time for side in sides],
            "residual_ratio": [side.middle("residual_ratio") for side in sides],
            "energy_J": [side.middle("energy") for side in sides],
            "worst_amplitude_m": [side.middle("worst_amplitude") for side in sides],
            "spread": [
                {key: [finite(end) for end in side.ends(name)] for key, name in _NUMBERS.items()}
                for side in sides
            ],
            "runs": [len(side.results) for side in sides],
            "runs_settled": [sum(math.isfinite(r.time) for r in side.results) for side in sides],
            "tuned": [dict(side.tuned) for side in sides],
            "span_s": self.span,
            "status": [side.status for side in sides],
            "models_used": [[asdict(used) for used in side.models_used] for side in sides],
            "rotor": {
                "source": rotor.source,
                "speed_rad_s": rotor.speed,
                "influence_m_per_kg_m": [rotor.influence.real, rotor.influence.imag],
                "unbalance_kg_m": [rotor.unbalance.real, rotor.unbalance.imag],
                "initial_amplitude_m": rotor.amplitude,
                "noise_m": rotor.noise,
                "limit_m": rotor.limit,
            },
        }


def compare(first: AnyScene, second: AnyScene, *, model_of: _ModelOf, runs: int = RUNS) -> Comparison:
    """Put two balancers on the rotor of the first scene, tune each, and let each balance it over one span.

    Of the second scene its balancer alone counts; `model_of` makes the model of a liquid ring.  A liquid ring
    has the gain that `tune` recommends for the target-vector algorithm, eccentric masses have theirs lowered
    to the recommended ones.
    Raises: SceneError: a balancer that cannot work on that rotor.
    """
    rotor = OneRotor.of(first)
    try:
        # Whether the second can work there at all is known before anything is run.
        scenes = own_scene(first), rotor.scene(second)
        span = max(_span(scene) for scene in scenes)
        one, other = (_side(rotor, scene, model_of, span=span, runs=runs) for scene in scenes)
    except SceneError as error:
        raise SceneError(_placed(first, fault) for fault in error.faults) from error
    return Comparison(rotor=rotor, span=span, sides=(one, other))


def _span(scene: AnyScene) -> float:
    start = scene.supervisor.start if isinstance(scene, EccentricScene) else 0.0
    return scene.run.time_limit - start


def _placed(first: AnyScene, fault: Fault) -> Fault:
    if fault.file == first.file:
        return fault
    return replace(fault, problem=f"on the rotor of {first.source}: {fault.problem}")


def _side(rotor: OneRotor, scene: AnyScene, model_of: _ModelOf, *, span: float, runs: int) -> Side:
    if isinstance(scene, EccentricScene):
        return _driven_side(rotor, scene, span=span, runs=runs)
    return _liquid_side(scene, model_of(scene), span=span, runs=runs)


def _liquid_side(scene: Scene, model: BalancerModel, *, span: float, runs: int) -> Side:
    # Valve-open times of the trial algorithm are the scene's.
    best = None
    if scene.controller.kind != "trial":
        best = recommended(scene, model, factor_uncertainty(scene, model))
    ready = scene if best is None else best.scene
    changes = _changes(scene.controller, ready.controller, chambers=scene.disc.chambers)
    ready = replace(ready, run=replace(ready.run, time_limit=span))
    done = [
        simulate(replace(ready, run=replace(ready.run, seed=ready.run.seed + i)), model, to_time_limit=True)
        for i in range(runs)
    ]
    results = tuple(
        Result(
            time=math.inf if run.settling_time is None else run.settling_time,
            residual_ratio=float(run.amplitude[-1] / run.amplitude[0]),
            energy=run.gas.energy,
            worst_amplitude=float(np.max(run.amplitude)),
            status=run.status,
        )
        for run in done
    )
    return Side(scene=ready, tuned=changes, results=results, models_used=done[0].models_used)


def _changes(before: ControllerSettings, after: ControllerSettings, *, chambers: int) -> dict[str, float]:
    """Scene keys that tuning has changed, with their values, SI."""
    changes = {}
    if after.proportional != before.proportional:
        changes["controller.proportional"] = after.proportional
    if after.gas_time_offset != before.gas_time_offset:
        offsets = zip(chamber_letters(chambers), after.offsets(chambers), strict=True)
        changes |= {f"controller.gas_time_offset.{letter}": offset for letter, offset in offsets}
    return changes


def _driven_side(rotor: OneRotor, scene: EccentricScene, *, span: float, runs: int) -> Side:
    start = scene.supervisor.start
    ready, changes = advised(replace(scene, run=replace(scene.run, time_limit=span + start)))
    results = []
    for i in range(runs):
        run = simulate_eccentric(replace(ready, run=replace(ready.run, seed=ready.run.seed + i)))
        settled = run.settled and run.settling_time is not None
        time = run.settling_time if settled and run.settling_time is not None else math.inf
        results.append(
            Result(
                time=max(0.0, time - start),
                residual_ratio=run.final_amplitude / rotor.amplitude,
                energy=run.electrical_energy,
                worst_amplitude=float(np.max(run.amplitude[run.time >= start])),
                status=run.status,
            )
        )
    return Side(scene=ready, tuned=changes, results=tuple(results))


_NUMBERS: Final = {
    "time_s": "time",
    "residual_ratio": "residual_ratio",
    "energy_J": "energy",
    "worst_amplitude_m": "worst_amplitude",
}
"""Keys of the document, each with its number of `Result`."""
