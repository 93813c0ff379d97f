"""Inputs that were fitted together, in a calibration's intervals and in its law."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from quantities import inputs_of

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.making import nominal_law, side_laws
from ringbalance.reduced_model.law.sides import half_widths_of
from ringbalance.reduced_model.tube.heads import velocities_of
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.fitted import Fitted, FittedQuantity, ModelError
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import NORMAL_95, with_value
from scenes import with_tables

SIZES = {
    "tube.bore": 3e-5,
    "tube.length": 2e-3,
    "model: friction correlation, even": 0.8,
    "gas.pressure": 7e3,
}
UNITS = {"tube.bore": "m", "tube.length": "m", "gas.pressure": "Pa"}


def table(correlation: float) -> FloatArray:
    """Of one size: above zero effects on the velocity add, below zero the bore's is made up for by others."""
    signs = np.array([math.copysign(1.0, correlation), -1, -1, 1])
    return np.asarray(abs(correlation) * np.outer(signs, signs) + (1 - abs(correlation)) * np.eye(4))


def fitted(scene: Scene, correlation: float) -> Scene:
    """Bore, length, friction and gas pressure fitted together; all else exact, and a tube that stays full."""
    rows = table(correlation)
    quantities = tuple(
        FittedQuantity(
            quantity=name,
            unit=UNITS.get(name, "1"),
            standard_deviation=size,
            correlations=tuple(row.tolist()),
        )
        for (name, size), row in zip(SIZES.items(), rows, strict=True)
    )
    exact = replace(scene.liquid, density_uncertainty=0.0, viscosity_uncertainty=0.0)
    tube = replace(scene.tube, hump_radius=None, roughness=0.0)
    return replace(scene, liquid=exact, tube=tube, uncertainty=(), fitted=Fitted(quantities=quantities))


def by_hand(scene: Scene, correlation: float) -> float:
    """1.96 sqrt(J C J') of the velocity, J by small steps."""

    def velocity(changed: Scene) -> float:
        law = nominal_law(changed, gravity=False)
        return float(law.evaluate(fill_ratio=0.25, gas_pressure=changed.gas.pressure, primed=True).velocity)

    def moved(step: float) -> list[Scene]:
        error = ModelError(cause="friction correlation", even=0.8 * step)
        return [
            with_value(scene=scene, quantity="bore", value=scene.tube.bore + step * 3e-5),
            with_value(scene=scene, quantity="length", value=scene.tube.length + step * 2e-3),
            with_tables(scene, tube={"model_errors": (error,)}),
            with_value(scene=scene, quantity="pressure", value=scene.gas.pressure + step * 7e3),
        ]

    effects = np.array(
        [(velocity(b) - velocity(a)) / 0.2 for a, b in zip(moved(-0.1), moved(0.1), strict=True)]
    )
    return float(NORMAL_95 * np.sqrt(effects @ table(correlation) @ effects))


def found(scene: Scene) -> tuple[Calibration, float]:
    """The calibration, and what its law adds to the velocity's uncertainty by the fitted inputs."""
    sizes = [1e-6 * each.standard_deviation for each in scene.fitted.quantities]
    pairs = zip(scene.fitted.quantities, sizes, strict=True)
    exact = Fitted(quantities=tuple(replace(each, standard_deviation=size) for each, size in pairs))
    point = tuple(map(np.array, (0.25, 0.25, scene.gas.pressure, True)))
    with_them, without = (
        float(half_widths_of(side_laws(each), *point)[0]) for each in (scene, replace(scene, fitted=exact))
    )
    return calibrate(scene), float(np.sqrt(with_them**2 - without**2))


def test_budget_and_law_follow_the_correlations(paper_scene: Scene) -> None:
    """Within 5 %: a step of a whole half-width is no derivative. The independent sum is another number."""
    alone = by_hand(fitted(paper_scene, 0.0), 0.0)
    for correlation in (-0.9, 0.9):
        scene = fitted(paper_scene, correlation)
        expected = by_hand(scene, correlation)
        calibration, by_law = found(scene)
        inputs = inputs_of(calibration.quantities["velocity"])
        assert set(inputs) == {"fitted"}
        assert inputs["fitted"] == pytest.approx(expected, rel=0.05)
        assert by_law == pytest.approx(expected, rel=0.05)
        assert expected != pytest.approx(alone, rel=0.15)


def test_a_correction_of_a_model_changes_the_law(paper_scene: Scene) -> None:
    """Two standard deviations of friction more, at cos(ln Re) of either sign: another k, another velocity."""
    error = ModelError(cause="friction correlation", even=2.0)
    corrected = with_tables(paper_scene, tube={"model_errors": (error,)})
    both = [calibrate(scene) for scene in (paper_scene, corrected)]
    k = [float(each.tube.k.value[-1]) for each in both]
    velocity = [each.answers.velocity for each in both]
    assert abs(k[1] / k[0] - 1) > 0.005
    assert velocity[1] != pytest.approx(velocity[0], rel=1e-4)


TRANSITION = [
    {"cause": "ends", "even": -0.17, "odd": -0.38},
    {"cause": "rotation model", "even": -0.5, "odd": -1.3},
]


def test_errors_of_ordinary_size_leave_a_head_that_grows_through_the_transition(paper_scene: Scene) -> None:
    """Those that the bundled injections leave: a width that stepped at Re = 2000 made the head step down."""
    scene = paper_scene.with_values({"tube.model_errors": TRANSITION})
    assert 0 < calibrate(scene).answers.velocity < math.inf


def test_a_head_that_falls_with_what_a_fit_tries_is_level(paper_scene: Scene) -> None:
    """The ends of the errors that it tries, of rotation in a wide tube at high speed, halve a head."""
    causes = "rotation model", "rotation as built"
    errors = [{"cause": each, "even": -2.5, "odd": -2.5} for each in causes]
    wide = {"tube.model_errors": errors, "tube.bore": 4e-3, "rotor.speed": 1620.0}
    scene = paper_scene.with_values(wide)
    assert np.all(np.diff(velocities_of(nominal_law(scene, gravity=False).heads.siphon)) > 0)
    with pytest.raises(SceneError, match="does not grow"):
        calibrate(scene)


@pytest.mark.parametrize("size", [-100.0, 100.0])
def test_errors_that_make_no_loss_are_refused_by_name(paper_scene: Scene, size: float) -> None:
    scene = paper_scene.with_values({"tube.model_errors": [{"cause": "ends", "even": size, "odd": size}]})
    with pytest.raises(SceneError) as error:
        calibrate(scene)
    assert [(fault.table, fault.key) for fault in error.value.faults] == [("tube", "model_errors")]
