"""Whether a balancer model and a scene are about one disc."""

from __future__ import annotations

from typing import Final

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.scene.describe import scene_fault
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.models import Scene

VOLUME_TOLERANCE: Final = 0.05
"""Relative: a flat-strip volume or an input's spread passes, another disc does not."""


def check_fit(scene: Scene, model: BalancerModel) -> None:
    """Refuse a model that was made for another disc.

    Args:
        scene: the scene.
        model: the balancer.

    Raises:
        SceneError: largest fill or chamber volume of the scene and of the model do not agree.
    """
    faults = [*_fill_faults(scene, model), *_volume_faults(scene, model)]
    if faults:
        raise SceneError(faults)


def _fill_faults(scene: Scene, model: BalancerModel) -> list[Fault]:
    largest = model.flow.max_fill_ratio
    if abs(scene.disc.max_fill_ratio - largest) <= 1e-9:
        return []
    problem = f"the {model.name} law was made for another fill"
    return [
        scene_fault(
            scene=scene, table="disc", key="max_fill_ratio", problem=problem, allowed=f"{largest:.6g}"
        )
    ]


def _volume_faults(scene: Scene, model: BalancerModel) -> list[Fault]:
    volume = chamber_volume(disc=scene.disc)
    if abs(model.chamber_volume / volume - 1) <= VOLUME_TOLERANCE:
        return []
    found = model.chamber_volume
    problem = (
        f"a chamber holds {volume * 1e6:.4g} ml here, {found * 1e6:.4g} ml for the {model.name} law: "
        "that was made for another disc"
    )
    return [
        scene_fault(
            scene=scene,
            table="disc",
            key="axial_width",
            problem=problem,
            allowed="that disc, or a law made for this one",
        )
    ]
