"""The closed loop on imported chambers: moments across their middles, less space than their sector."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from block_discs import imported, turned

from ringbalance.controller.balancer import AS_GIVEN
from ringbalance.controller.liquid_ring.devices import Spread
from ringbalance.controller.liquid_ring.drawn_runs import DrawnRuns
from ringbalance.controller.loop import simulate
from ringbalance.mesh.geometry import chamber_volume
from ringbalance.reduced_model.law.flow_law import BalancerModel, MomentCurve
from ringbalance.reduced_model.law.making import nominal_law
from ringbalance.reduced_model.law.paper_law import paper_model
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.verification.reference.chambers import disc_chamber
from scenes import with_tables

ANGLE = 0.35


@dataclass(frozen=True)
class Bent:
    """Moments whose direction changes with the fill."""

    plain: MomentCurve
    least: float
    most: float

    def pair_moment(self, **fills: Any) -> Any:
        return self.pair_vector(**fills).real

    def pair_vector(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> Any:
        x, y = np.asarray(fill_ratio), np.asarray(opposite_fill_ratio)
        angle = self.least + (self.most - self.least) * np.abs(x - y) / (x + y)
        return self.plain.pair_moment(fill_ratio=x, opposite_fill_ratio=y) * np.exp(1j * angle)


@pytest.fixture
def exact(scene: Scene) -> Scene:
    """A run without noise, whose controller assumes the scene's lag whatever the rotor has."""
    quiet = replace(scene.sensor, amplitude_noise=0.0, phase_noise=0.0)
    settings = replace(scene.controller, assumed_lag_angle=scene.rotor.lag_angle)
    return with_tables(scene, sensor=quiet, controller=settings, run={"time_limit": 8.0})


def test_chambers_beside_their_middles_act_as_a_rotor_with_less_lag(exact: Scene) -> None:
    """All moments turned by an angle, K exp(j angle) U, are a lag that is less by it."""
    beside = replace(exact, disc=turned(exact.disc, angle=ANGLE))
    less = replace(exact.rotor, lag_angle=exact.rotor.lag_angle - ANGLE)
    alike = replace(exact, disc=imported(exact.disc), rotor=less)
    runs = [simulate(s, BalancerModel.of(nominal_law(s, gravity=False))) for s in (beside, alike)]
    assert runs[0].amplitude.size == runs[1].amplitude.size
    np.testing.assert_allclose(runs[0].amplitude, runs[1].amplitude, rtol=1e-5, atol=1e-11)


@pytest.mark.parametrize("most", [ANGLE, 3 * ANGLE])
def test_an_untraced_run_is_the_traced_one(exact: Scene, model: BalancerModel, most: float) -> None:
    bent = replace(model, moment=Bent(model.moment, ANGLE, most))
    run, plain = (simulate(exact, m) for m in (bent, model))
    runs = DrawnRuns(
        scene=exact, model=bent, spread=Spread.of(exact, bent, remade=False), limit=exact.controller.limit
    )
    (result,) = runs.outcomes([{}], AS_GIVEN)
    assert abs(run.amplitude[-1] - plain.amplitude[-1]) > 1e-8
    # Steps of an untraced run may err by 1e-6 in fill, and a fill moves the vibration by some 50 um.
    assert result.final_amplitude[0] == pytest.approx(run.amplitude[-1], abs=5e-11)


def test_the_papers_law_takes_a_chamber_with_much_less_space_than_its_sector(exact: Scene) -> None:
    """Ribs that take a tenth of a sector are not in Eq. 4, and the disc is the same; a longer one is not."""
    ribbed = disc_chamber(replace(exact.disc, plate_thickness=4e-3), (4, 16, 2))
    disc = replace(exact.disc, plate_thickness=0.0, geometry=ribbed)
    run = simulate(replace(exact, disc=disc), paper_model(replace(exact, disc=disc)))
    assert run.model.chamber_volume > 1.1 * chamber_volume(disc=disc)
    longer = replace(exact, disc=replace(disc, axial_width=1.1 * disc.axial_width))
    with pytest.raises(SceneError, match="made for another disc"):
        simulate(longer, paper_model(replace(exact, disc=disc)))
