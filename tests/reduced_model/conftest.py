"""The paper's disc as records, so that these tests do not depend on reading scene files."""

from __future__ import annotations

import dataclasses
import math

import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.scene import loop_models, models

DISC = models.Disc(
    outer_radius=44.5e-3,
    inner_radius=20.5e-3,
    axial_width=62e-3,
    central_angle=math.pi / 2,
    chambers=4,
    plate_thickness=2.777e-3,
    max_fill_ratio=0.5,
    initial_fill=0.25,
)
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
TUBE = models.Tube(
    bore=1.5e-3,
    port_radius=44.5e-3,
    hump_radius=31.5e-3,
    hump_position=0.5,
    hump_shape="arc",
    hump_gas="vented",
    length=120e-3,
    roughness=1.5e-6,
    entrance="sharp",
    entrance_radius=0.0,
    bends=(models.Bend(angle=math.pi / 2, radius=3e-3), models.Bend(angle=math.pi / 2, radius=3e-3)),
    extra_loss=0.0,
    drag_coefficient=None,
)
GAS = models.Gas(
    pressure=0.7e6,
    measured_at="chamber",
    ambient_pressure=101325.0,
    temperature=293.15,
    conductance=None,
    critical_ratio=None,
    dead_volume=None,
    valve_lag=None,
    process="isothermal",
)
ROTOR = loop_models.Rotor(
    speed=10000 * 2 * math.pi / 60,
    influence_coefficient=0.0108,
    lag_angle=math.radians(17),
    initial_amplitude=10e-6,
    initial_phase=math.pi / 2,
)
CONTROLLER = loop_models.ControllerSettings(
    kind="target_vector",
    limit=0.05e-6,
    period=0.5,
    hold_time=5.0,
    proportional=0.08e6,
    integral_time=48.0,
    derivative_time=0.06,
    minimum_gas_time=1e-3,
    maximum_gas_time=5.0,
    assumed_influence_coefficient=0.0108,
    assumed_lag_angle=math.radians(17),
    sequence=("A", "C", "B", "D"),
    first_trial=0.1,
    long_step=0.5,
    short_step=0.05,
    fine_below=0.8e-6,
)


@pytest.fixture(scope="session")
def table_1_scene() -> models.Scene:
    """Table 1 of the liquid-ring paper with its density of 1 g/ml and an assumed tube."""
    return models.Scene(
        name="the paper's disc",
        disc=DISC,
        liquid=LIQUID,
        tube=TUBE,
        gas=GAS,
        environment=loop_models.Environment(shaft="horizontal", gravity=9.80665),
        rotor=ROTOR,
        sensor=loop_models.Sensor(amplitude_noise=0.0, phase_noise=0.0),
        controller=CONTROLLER,
        uncertainty=(),
        run=loop_models.RunSettings(seed=0, time_limit=120.0),
        tolerance=0.01,
        source="test.toml",
        file="test.toml",
        sha256="0" * 64,
    )


@pytest.fixture(scope="session")
def point_scene(table_1_scene: models.Scene) -> models.Scene:
    """The same with a crest that the tube touches at a point, and degassed liquid."""
    return dataclasses.replace(
        table_1_scene,
        tube=dataclasses.replace(table_1_scene.tube, hump_shape="point"),
        liquid=dataclasses.replace(table_1_scene.liquid, dissolved_gas="none"),
    )


@pytest.fixture(scope="session")
def point_calibration(point_scene: models.Scene) -> Calibration:
    """Calibration of that scene."""
    return calibrate(point_scene)


@pytest.fixture(scope="session")
def table_1_calibration(table_1_scene: models.Scene) -> Calibration:
    """Calibration of that scene."""
    return calibrate(table_1_scene)
