"""Bundled scenes of eccentric masses, and what tests ask of their runs."""

from __future__ import annotations

import math

import numpy as np

from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import simulate_eccentric
from ringbalance.controller.eccentric_mass.run_record import EccentricRun, StageSpan
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, eccentric_scene
from ringbalance.scene import bundled_scene, load_scene
from ringbalance.scene.arrays import FloatArray


def bundled(name: str) -> EccentricScene:
    return eccentric_scene(load_scene(bundled_scene(name)))


def true_imbalance(scene: EccentricScene) -> FloatArray:
    """Along the rotor's axes, kg m, shape (2,)."""
    plant = PlantParameters.of(scene)
    return plant.unbalance * np.array([math.cos(plant.phase), math.sin(plant.phase)])


def normalised(scene: EccentricScene, seed: int) -> float:
    """Squared error of the imbalance over the filter's covariance, at the end of a run."""
    run = simulate_eccentric(scene, seed=seed)
    error = run.history["imbalance"][-1] - true_imbalance(scene)
    return float(error @ np.linalg.solve(run.history["imbalance_covariance"][-1], error))


def stage_names(run: EccentricRun) -> list[str]:
    return [stage.name for stage in run.stages]


def stage_of(run: EccentricRun, name: str) -> StageSpan:
    """The first stage of that name."""
    return next(stage for stage in run.stages if stage.name == name)
