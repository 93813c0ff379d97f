"""Two balancers side by side on one rotor: time, what is left, energy, and the worst amplitude on the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ringbalance.controller.compare_rotor import OneRotor, own_scene, rotor_of, scene_on
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.loop import simulate
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.selection.registry import ModelUsed
from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene

ModelOf = Callable[[Scene], BalancerModel]
"""Makes the model of a liquid ring from its scene on the common rotor."""


@dataclass(frozen=True, kw_only=True)
class Side:
    """One balancer of a comparison."""

    scene: AnyScene
    """As it was run, on the common rotor."""
    settled: bool
    """Whether the amplitude comes below the common limit and stays there."""
    time: float | None
    """s, from the start of balancing until the amplitude stays below the limit; None when it does not."""
    residual_ratio: float
    """Amplitude at the end over the one before balancing."""
    energy: float
    """What the balancer took, J: the integral of p dV of the gas, or of the motors' electrical power."""
    worst_amplitude: float
    """Largest amplitude from the start of balancing on, m zero-to-peak."""
    status: str
    """How the run ended and what to do next."""
    models_used: tuple[ModelUsed, ...] = ()
    """Of a liquid ring: every physical term, with its model and its estimated contribution."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Two balancers on one rotor."""

    rotor: OneRotor
    """That of the first scene."""
    sides: tuple[Side, Side]
    """In the order of the scenes."""


def compare(first: AnyScene, second: AnyScene, *, model_of: ModelOf) -> Comparison:
    """Put two balancers on the rotor of the first scene, and let each balance it.

    Of the second scene its balancer alone counts; `model_of` makes the model of a liquid ring.
    Raises: SceneError: a balancer that cannot work on that rotor.
    """
    rotor = rotor_of(first)
    try:
        # Whether the second can work there at all is known before anything is run.
        guest = scene_on(rotor, second)
        one, other = _side(rotor, own_scene(first), model_of), _side(rotor, guest, model_of)
    except SceneError as error:
        raise SceneError(_placed(first, fault) for fault in error.faults) from error
    return Comparison(rotor=rotor, sides=(one, other))


def _placed(first: AnyScene, fault: Fault) -> Fault:
    if fault.file == first.file:
        return fault
    return replace(fault, problem=f"on the rotor of {first.source}: {fault.problem}")


def _side(rotor: OneRotor, scene: AnyScene, model_of: ModelOf) -> Side:
    if isinstance(scene, EccentricScene):
        return _driven_side(rotor, scene)
    return _liquid_side(scene, model_of(scene))


def _liquid_side(scene: Scene, model: BalancerModel) -> Side:
    run = simulate(scene, model)
    return Side(
        scene=scene,
        settled=run.settled,
        time=run.settling_time,
        residual_ratio=float(run.amplitude[-1] / run.amplitude[0]),
        energy=run.energy,
        worst_amplitude=float(np.max(run.amplitude)),
        status=run.status,
        models_used=run.models_used,
    )


def _driven_side(rotor: OneRotor, scene: EccentricScene) -> Side:
    run, start = simulate_eccentric(scene), scene.supervisor.start
    balancing = run.time >= start
    settled = run.settled and run.settling_time is not None
    return Side(
        scene=scene,
        settled=settled,
        time=max(0.0, run.settling_time - start) if settled and run.settling_time is not None else None,
        residual_ratio=run.final_amplitude / rotor.amplitude,
        energy=run.electrical_energy,
        worst_amplitude=float(np.max(run.amplitude[balancing])),
        status=run.status,
    )


def comparison_document(comparison: Comparison) -> dict[str, Any]:
    """A comparison as a JSON document in SI; lists run along `scenes`; null: it did not settle."""
    sides, rotor = comparison.sides, comparison.rotor
    return {
        "scenes": [
            {"name": side.scene.name, "source": side.scene.source, "sha256": side.scene.sha256}
            for side in sides
        ],
        "balancer": [side.scene.balancer for side in sides],
        "settled": [side.settled for side in sides],
        "time_s": [side.time for side in sides],
        "residual_ratio": [side.residual_ratio for side in sides],
        "energy_J": [side.energy for side in sides],
        "worst_amplitude_m": [side.worst_amplitude for side in sides],
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
