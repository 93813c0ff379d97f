"""One point, a few and many: the same bits, whoever runs the law's arithmetic; errors of tables are told."""

from __future__ import annotations

import numpy as np
import pytest
from law_queries import queries

from ringbalance.physics.tube.loss import tube_loss
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Flow
from ringbalance.reduced_model.tube.heads import TubeHeads, roots_of
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import with_tolerance
from scenes import with_tables

NAMES = ("velocity", "uncertainty", "regime", "primed")


@pytest.fixture(scope="module")
def law(table_1_calibration: Calibration) -> CalibratedLaw:
    return table_1_calibration.flow_law


@pytest.mark.parametrize(("crest", "regimes"), [(True, {0, 1, 2, 4}), (False, {1, 3})])
def test_numbers_few_and_many_points_give_the_same_bits(
    law: CalibratedLaw, crest: bool, regimes: set[int]
) -> None:
    if not crest:
        law = with_tables(law, path={"hump_pressure": None})
    asked = queries(law, 4000)

    def evaluated(part: FloatArray) -> Flow:
        x, y, p, primed = part
        return law.evaluate(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=primed != 0)

    whole, parts = evaluated(asked), [evaluated(part) for part in np.split(asked, 40, axis=1)]
    asked.flags.writeable = False
    parts.append(evaluated(asked[:, :0]))
    assert (evaluated(asked).velocity == whole.velocity).all()
    for name in NAMES:
        few = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(getattr(whole, name), few)
        assert few.dtype == getattr(whole, name).dtype
    assert set(whole.regime.tolist()) == regimes
    (x, y, p, primed), many = asked[:, :100], parts[0]
    for at in range(100):
        one = law.evaluate(
            fill_ratio=float(x[at]),
            opposite_fill_ratio=y[at],
            gas_pressure=float(p[at]),
            primed=bool(primed[at]),
        )
        assert [getattr(one, name) for name in NAMES] == [getattr(many, name)[at] for name in NAMES]
        assert all(getattr(one, name).shape == () for name in NAMES)


@pytest.mark.parametrize("value", [-1e-9, 0.5 + 1e-9])
def test_round_off_beyond_a_fill_is_taken_as_its_end(law: CalibratedLaw, value: float) -> None:
    end = law.evaluate(fill_ratio=round(value, 6), gas_pressure=2e6)
    assert law.evaluate(fill_ratio=value, gas_pressure=2e6).velocity == end.velocity
    for wrong in ({"fill_ratio": value + 3 * (value - 0.25)}, {"opposite_fill_ratio": 0.6}):
        with pytest.raises(ValueError, match="must lie within"):
            law.evaluate(**({"fill_ratio": 0.2, "gas_pressure": 2e6} | wrong))


def test_as_many_knots_as_the_tolerance_asks_for(table_1_scene: Scene) -> None:
    """Between knots as well, but for a bend, the loss is met to a five-millionth of the tolerance."""
    u = np.geomspace(2e-5, 5e2, 3001)
    right = (tube_loss(table_1_scene, u).k.value + 1) * u**2 / 2
    counts, errors = [], []
    for tolerance in (0.1, 0.01, 1e-3):
        heads = TubeHeads.of(with_tolerance(table_1_scene, str(tolerance)))
        error = np.abs(roots_of(heads.siphon, u) ** 8 / right - 1)
        assert np.max(error) <= 1.5 * heads.interpolation_error
        counts.append(heads.siphon.knots.size)
        errors.append(np.quantile(error, 0.9))
    assert counts == sorted(counts)
    assert np.all(np.array(errors) < 2e-7 * np.array([0.1, 0.01, 1e-3]) + 1e-13)


def test_the_error_of_tables_is_part_of_the_uncertainty(law: CalibratedLaw) -> None:
    coarse = with_tables(law, heads={"interpolation_error": 0.02})
    at = {"fill_ratio": 0.3, "gas_pressure": 2e6, "primed": True}
    sharp, wide = law.evaluate(**at), coarse.evaluate(**at)
    added = np.sqrt(wide.uncertainty**2 - sharp.uncertainty**2) / sharp.velocity
    assert float(added) == pytest.approx(0.02, rel=1e-4)
