"""The friction blend against Churchill's own formula and against measurements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from fluids.friction import Churchill_1977

from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty, turbulent_share

Rows = Callable[[str], list[dict[str, float]]]


@pytest.mark.parametrize("roughness", [0.0, 1e-4, 1e-3, 0.05])
def test_without_rotation_it_is_churchills_formula(roughness: float) -> None:
    re = np.geomspace(1e-2, 1e9, 400)
    expected = [Churchill_1977(float(r), roughness) for r in re]
    np.testing.assert_allclose(
        friction_factor(reynolds=re, relative_roughness=roughness), expected, rtol=3e-15
    )


def test_literature_smooth_pipe_of_mckeon_et_al_2004(rows: Rows) -> None:
    data = [row for row in rows("mckeon2004_oregon_smooth.csv") if row["Re"] > 2000]
    re, measured = (np.array([row[key] for row in data]) for key in ("Re", "f_darcy"))
    error = np.abs(friction_factor(reynolds=re, relative_roughness=0.0) - measured)
    half_width = friction_uncertainty(reynolds=re, relative_roughness=0.0)
    assert np.mean(error <= half_width) >= 0.95
    developed = re > 4500
    assert np.max(error[developed] / measured[developed]) < 0.045
    # The bars are not padded: the worst point uses most of its own.
    assert np.max(error / half_width) > 0.5


def test_literature_laminar_part_of_mckeon_et_al_2004_reads_high(rows: Rows) -> None:
    data = [row for row in rows("mckeon2004_oregon_smooth.csv") if 200 < row["Re"] < 1500]
    ratio = [
        row["f_darcy"] / float(friction_factor(reynolds=row["Re"], relative_roughness=0)) for row in data
    ]
    assert min(ratio) > 0.99
    assert max(ratio) < 1.15


def test_literature_rough_pipes_of_nikuradse_1933(rows: Rows) -> None:
    for row in rows("nikuradse1933_rough.csv"):
        rough = 1 / (2 * row["R_over_ks"])
        f = float(friction_factor(reynolds=row["Re"], relative_roughness=rough))
        half_width = float(friction_uncertainty(reynolds=row["Re"], relative_roughness=rough))
        assert abs(f - row["f_darcy"]) <= half_width, row
        if row["Re"] * (f / 8) ** 0.5 * rough > 70:  # fully rough
            assert f == pytest.approx(row["f_darcy"], rel=0.04)


def test_branches_take_their_factors() -> None:
    laminar = friction_factor(reynolds=100.0, relative_roughness=0, laminar_ratio=3.0)
    assert float(laminar) == pytest.approx(3 * 0.64, rel=1e-9)
    plain, turning = (
        float(friction_factor(reynolds=1e5, relative_roughness=1e-3, turbulent_ratio=r)) for r in (1, 1.3)
    )
    assert turning / plain == pytest.approx(1.3, rel=1e-9)
    delayed = friction_factor(reynolds=4000.0, relative_roughness=0, critical_ratio=3.0)
    assert float(delayed) == pytest.approx(64 / 4000, rel=1e-2)


def test_turbulent_share_is_a_half_at_the_critical_reynolds_number() -> None:
    critical = 1070 * 28**0.23
    assert float(turbulent_share(reynolds=critical)) == pytest.approx(0.5)
    assert float(turbulent_share(reynolds=2 * critical, critical_ratio=2.0)) == pytest.approx(0.5)
