"""The liquid-ring paper's disc as Table 1 has it: round numbers, exactly known inputs, no noise."""

from __future__ import annotations

import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.scene import loop_models, models
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.narrowing import liquid_ring_scene
from scenes import with_tables

LIQUID = models.Liquid(
    name="custom",
    temperature=None,
    density=1000.0,
    kinematic_viscosity=1e-6,
    vapour_pressure=2339.0,
    dissolved_gas="saturated",
    density_uncertainty=0.001,
    viscosity_uncertainty=0.01,
    source="test",
)


@pytest.fixture(scope="session")
def table_1_scene() -> models.Scene:
    """Table 1 of the liquid-ring paper with its density of 1 g/ml and an assumed tube."""
    scene = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
    trial = {"first_trial": 0.1, "long_step": 0.5, "short_step": 0.05}
    return with_tables(
        scene,
        liquid=LIQUID,
        sensor=loop_models.Sensor(amplitude_noise=0.0, phase_noise=0.0),
        controller=trial,
        uncertainty=(),
    )


@pytest.fixture(scope="session")
def point_scene(table_1_scene: models.Scene) -> models.Scene:
    """The same with a crest that the tube touches at a point, and degassed liquid."""
    return with_tables(table_1_scene, tube={"hump_shape": "point"}, liquid={"dissolved_gas": "none"})


@pytest.fixture(scope="session")
def point_calibration(point_scene: models.Scene) -> Calibration:
    """Calibration of that scene."""
    return calibrate(point_scene)


@pytest.fixture(scope="session")
def table_1_calibration(table_1_scene: models.Scene) -> Calibration:
    """Calibration of that scene."""
    return calibrate(table_1_scene)
