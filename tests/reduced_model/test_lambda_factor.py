"""A measured factor on lambda reaches all that depends on moments, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.estimates import injection_time
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from scenes import with_tables

FACTOR = 0.93
WIDTH = 0.02


@pytest.fixture(scope="module")
def by_geometry(paper_scene: Scene) -> Calibration:
    return calibrate(paper_scene)


@pytest.fixture(scope="module")
def measured(paper_scene: Scene) -> Calibration:
    factor = InputUncertainty(quantity="lambda_factor", half_width=WIDTH, relative=False)
    disc = replace(paper_scene.disc, lambda_factor=FACTOR)
    return calibrate(replace(paper_scene, disc=disc, uncertainty=(*paper_scene.uncertainty, factor)))


def test_lambda_and_moments_are_multiplied(by_geometry: Calibration, measured: Calibration) -> None:
    lam, plain = measured.chamber.moment_per_mass, by_geometry.chamber.moment_per_mass
    assert float(lam.value) == pytest.approx(FACTOR * float(plain.value), rel=1e-14)
    assert float(lam.uncertainty) == pytest.approx(FACTOR * float(plain.uncertainty), rel=1e-9)
    np.testing.assert_allclose(measured.chamber.moment.value, FACTOR * by_geometry.chamber.moment.value)
    fills = np.linspace(0.0, measured.scene.disc.max_fill_ratio, 7)
    np.testing.assert_allclose(
        measured.lambda_over_fill(fill_ratio=fills),
        FACTOR * by_geometry.lambda_over_fill(fill_ratio=fills),
        rtol=1e-9,
    )
    assert measured.answers.usable_moment == pytest.approx(FACTOR * by_geometry.answers.usable_moment)


def test_flow_and_geometry_stay(by_geometry: Calibration, measured: Calibration) -> None:
    """Finite elements check the geometry, so they agree with it whatever was measured."""
    assert measured.answers.velocity == by_geometry.answers.velocity
    np.testing.assert_array_equal(
        measured.chamber.wall_pressure.value, by_geometry.chamber.wall_pressure.value
    )
    assert measured.chamber.check.status.ok
    assert measured.chamber.check.excess == by_geometry.chamber.check.excess


def test_its_uncertainty_is_in_the_budget(by_geometry: Calibration, measured: Calibration) -> None:
    lam = float(by_geometry.chamber.moment_per_mass.value)
    share = measured.quantities["lambda"].causes["disc.lambda_factor"]
    assert share == pytest.approx(WIDTH * lam, rel=1e-6)
    before, after = (each.quantities["lambda"].parts for each in (by_geometry, measured))
    assert before is not None
    assert after is not None
    assert after.input == pytest.approx(np.hypot(FACTOR * before.input, WIDTH * lam), rel=1e-6)
    assert "disc.lambda_factor" not in measured.quantities["velocity"].causes


def test_the_injection_that_decides_is_longer_by_it(paper_scene: Scene) -> None:
    law_based = replace(paper_scene.controller, kind="law_based")
    plain = replace(paper_scene, controller=law_based)
    smaller = with_tables(plain, disc={"lambda_factor": 0.5})
    assert injection_time(smaller) == pytest.approx(2 * injection_time(plain))
