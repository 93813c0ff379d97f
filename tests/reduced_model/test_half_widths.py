"""The table of a law's half-widths beside the batch of sides that it is made of, between and at its nodes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final, NamedTuple, cast

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.making import side_laws
from ringbalance.reduced_model.law.sides import half_widths_of
from ringbalance.reduced_model.tube.regime import covered, discharges_openly
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Scene

NAMES: Final = ("liquid_ring_paper", "grinding_spindle", "silicone_oil_100cst", "six_chamber")
DRAWN: Final = 3000


class Compared(NamedTuple):
    """Half-widths in drawn conditions of flowing tubes."""

    velocity: FloatArray
    tabled: FloatArray
    exact: FloatArray
    margins: FloatArray
    """Of the margin, in the table and exactly, shape (2, n)."""
    one_regime: BoolArray
    """Whether the tube flows in one regime at all corners of the cell, for the sides' laws too, with the
    same ports covered."""


def regimes(laws: tuple[CalibratedLaw, ...], x: FloatArray, p: FloatArray, primed: BoolArray) -> FloatArray:
    """Regime of each law, and whether liquid covers either port; a number for each, shape (laws, n)."""
    fills, numbers = {"fill_ratio": x, "opposite_fill_ratio": laws[0].max_fill_ratio - x}, []
    for law in laws:
        regime, ends = law.evaluate(**fills, gas_pressure=p, primed=primed).regime, law.ends(**fills)
        numbers.append(regime + 10.0 * covered(law.path, ends) + 20.0 * discharges_openly(law.path, ends))
    return np.array(numbers)


@pytest.fixture(scope="module", params=NAMES)
def compared(request: pytest.FixtureRequest) -> Compared:
    scene = cast(Scene, rb.load_scene(rb.bundled_scene(request.param)))
    law, laws = rb.calibrate(scene).flow_law, side_laws(scene)
    table = law.half_widths
    assert table is not None
    rng = np.random.default_rng(5)
    top, highest = law.max_fill_ratio, 1.5 * scene.gas.pressure
    x, p, primed = rng.uniform(0, top, DRAWN), rng.uniform(0, highest, DRAWN), rng.random(DRAWN) < 0.5
    velocity = replace(law, half_widths=None).evaluate(fill_ratio=x, gas_pressure=p, primed=primed).velocity
    flows = velocity != 0
    x, p, primed, velocity = x[flows], p[flows], primed[flows], velocity[flows]
    wall = law.gas_factor * p + law.hydrostatic_pressure(x)
    exact = half_widths_of(laws, x, top - x, p, primed)
    tabled = np.array(table.at(x, wall, primed))
    corners = []
    for side in (0, 1):
        fills = table.fill_ratio[np.clip(np.searchsorted(table.fill_ratio, x) - 1 + side, 0, None)]
        for end in (0, 1):
            pressures = table.wall_pressure
            at = pressures[np.clip(np.searchsorted(pressures, wall) - 1 + end, 0, None)]
            gas = (at - law.hydrostatic_pressure(fills)) / law.gas_factor
            corners.append(regimes(laws, fills, np.maximum(gas, -law.ambient_pressure), primed))
    alike = np.all(np.array(corners) == corners[0][:1], axis=(0, 1))
    return Compared(
        velocity=velocity,
        tabled=tabled[0],
        exact=exact[0],
        margins=np.array([tabled[1], exact[1]]),
        one_regime=alike,
    )


def test_within_one_regime_the_table_is_the_batch(compared: Compared) -> None:
    """A half-width is known to a tenth at the best, as sides of one input at a time are no quantiles of all:
    half of that is allowed, and in one point of fifty, next to the top and the bottom, all of it."""
    off = np.abs(compared.tabled / compared.exact - 1)[compared.one_regime]
    assert off.size > 200
    assert np.quantile(off, 0.98) < 0.05
    assert np.max(off) < 0.1


def test_across_a_change_of_regime_it_lies_between(compared: Compared) -> None:
    """There a half-width steps within a cell, from a part of the velocity to all of it: the table may miss
    the whole step, which the velocity bounds; half of such points are within a fifth."""
    across = ~compared.one_regime
    off = np.abs(compared.tabled - compared.exact)[across]
    assert np.median(off / compared.exact[across]) < 0.2
    # A corner of the cell flows faster than the point itself, or where that has no flow yet.
    assert np.quantile(off / np.abs(compared.velocity[across]), 0.95) < 1.0


def test_whether_a_regime_is_undecided_hangs_on_the_batch(compared: Compared) -> None:
    """Half-widths of the margin, where both are larger than a thousandth of the largest."""
    tabled, exact = compared.margins[:, compared.one_regime]
    seen = exact > 1e-3 * np.max(exact)
    assert np.quantile(np.abs(tabled / exact - 1)[seen], 0.98) < 0.05


def test_at_the_operating_point_it_is_that_of_the_quantities(table_1_calibration: Calibration) -> None:
    """The law is on 257 knots and without gravity, and between nodes a half-width is off by a hundredth."""
    law, parts = table_1_calibration.flow_law, table_1_calibration.quantities["velocity"].parts
    assert parts is not None
    pressure = table_1_calibration.scene.gas.pressure
    flow = law.evaluate(fill_ratio=law.max_fill_ratio / 2, gas_pressure=pressure)
    expected = math.hypot(parts.numerical, parts.input, parts.model)
    assert float(flow.uncertainty) == pytest.approx(expected, rel=0.02)


def test_other_liquid_opposite_counts_as_the_pressure_that_drives_alike(
    table_1_calibration: Calibration,
) -> None:
    """Each fill of its own: a full siphon's levels differ, a separated column's opposite level counts not."""
    law, laws = table_1_calibration.flow_law, side_laws(table_1_calibration.scene)
    rng = np.random.default_rng(6)
    x, y = rng.uniform(0.05, 0.45, (2, DRAWN))
    p = rng.uniform(0, 1.5e6, DRAWN)
    flow = law.evaluate(fill_ratio=x, opposite_fill_ratio=y, gas_pressure=p, primed=True)
    exact = half_widths_of(laws, x, y, p, np.ones(DRAWN, dtype=np.bool_))[0]
    flows = flow.velocity > 0
    off = np.abs(flow.uncertainty / np.maximum(exact, 1e-9) - 1)[flows]
    assert np.median(off) < 0.02
    assert np.quantile(off, 0.9) < 0.1
