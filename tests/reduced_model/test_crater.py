"""Crater of a scene's gas jet: over the fill, in a calibration, and the range of a scene without the hole."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import OF_THE_JET
from ringbalance.reduced_model.crater import Crater, crater_range, jet_text, largest_ratio
from ringbalance.results.numbers import percent
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import with_model_errors
from scenes import bundled

HOLE = {"disc.gas_hole_diameter": "3 mm", "disc.gas_hole_radius": "30 mm"}


@pytest.fixture(scope="module")
def spindle() -> Scene:
    return bundled("grinding_spindle")


@pytest.fixture(scope="module")
def holed(spindle: Scene) -> Any:
    return spindle.with_values(HOLE)


def test_the_crater_balances_the_jet(holed: Scene) -> None:
    """By hand: a choked valve, a hole whose gas is slower than sound, C_d = 0.8, K = 6.5, 10 mm of path."""
    area, flow = 0.8 * math.pi / 4 * 3e-3**2, 0.3e-8 * 1e5 * (0.6e6 + 101325)
    # R T m' = p A M sqrt(gamma R T (1 + M^2/5)), since the gas is colder by that factor as it moves.
    mach = 0.0
    for _ in range(50):
        mach = flow / (101325 * area * math.sqrt(1.4 * 287.05 * 293.15)) / math.sqrt(1 + mach**2 / 5)
    assert mach < 1
    crater = Crater.of(holed, 0.25)
    level = 40.01e-3
    n, momentum = float(crater.depth), area * 1.4 * 101325 * mach**2
    core = 101325 * ((1 + mach**2 / 5) ** 3.5 - 1)
    pressure = min(core, 2 * 6.5**2 * momentum / (math.pi * (level - 30e-3 + n) ** 2))
    square = holed.rotor.speed**2 * holed.liquid.density / 2 * ((level + n) ** 2 - level**2)
    assert square == pytest.approx(pressure, rel=2e-3)
    assert float(crater.ratio) == pytest.approx(n / (44.5e-3 - level), rel=2e-3)


def test_the_shallower_the_ring_the_larger_the_part(holed: Scene) -> None:
    for direction in ("outward", "axial", "inward"):
        fills = np.linspace(0.01, 0.5, 50)
        ratios = Crater.of(holed.with_values({"disc.gas_hole_direction": direction}), fills).ratio
        assert np.all(np.diff(ratios) < 0)
    least = np.array([0.1, math.inf])
    assert largest_ratio(holed, least).tolist() == [float(Crater.of(holed, 0.1).ratio), 0.0]


def test_a_turned_hole_digs_less(holed: Scene) -> None:
    outward, axial, inward = (
        float(Crater.of(holed.with_values({"disc.gas_hole_direction": each}), 0.25).depth)
        for each in ("outward", "axial", "inward")
    )
    assert outward > inward > axial > 0


def test_errors_of_the_models_move_the_crater_to_both_sides(holed: Scene) -> None:
    def depth(**errors: float) -> float:
        named = {f"model: {name.replace('_', ' ')}": size for name, size in errors.items()}
        return float(Crater.of(with_model_errors(holed, named), 0.25).depth)

    ends = [depth(discharge_of_the_gas_hole=each) for each in (-1.96, 0.0, 1.96)]
    assert ends == sorted(ends, reverse=True)
    assert depth(discharge_of_the_gas_hole=-2.5) == ends[0]
    far = holed.with_values({"disc.gas_hole_radius": "21 mm"})
    near, wide = (
        float(Crater.of(with_model_errors(far, {"model: decay of the gas jet": each}), 0.25).depth)
        for each in (-1.96, 1.96)
    )
    assert 1.3 < wide / near < 1.2**4


def test_a_calibration_has_the_crater_with_its_interval(holed: Scene) -> None:
    result = calibrate(holed)
    half, least = (Crater.of(holed, each) for each in (0.25, float(result.answers.least_fill_ratio)))
    values = {name: result.quantities[name] for name in OF_THE_JET}
    expected = float(half.depth), float(least.ratio), float(half.blowing_number)
    assert [each.value for each in values.values()] == pytest.approx(expected)
    for each in values.values():
        assert each.status == "ok"
        assert each.lower < each.value < each.upper  # type: ignore[operator]
        assert "model: discharge of the gas hole" in each.causes
    told = [each.values["number"] for each in result.rows().findings if each.code == "gas_jet_droplets"]
    assert told == [values["blowing_number"].value]
    assert expected[2] > 1.0
    calm = calibrate(
        holed.with_values({"disc.gas_hole_diameter": "9 mm", "disc.gas_hole_direction": "axial"})
    )
    assert (calm.quantities["blowing_number"].value or 0.0) < 1.0
    assert "gas_jet_droplets" not in [each.code for each in calm.rows().findings]
    term = result.models_used[-1]
    assert term.estimated_contribution == pytest.approx(float(half.ratio))
    assert term.model == "not modelled in this version"


def test_a_hole_that_does_not_blow_at_the_ring_has_a_bound(holed: Scene) -> None:
    result = calibrate(holed.with_values({"disc.gas_hole_direction": "inward"}))
    assert {result.quantities[name].status for name in OF_THE_JET} == {"gas_jet_bound"}
    assert [each.code for each in result.rows().findings].count("gas_jet_bound") == 1
    assert "at most" in jet_text(result.scene)


def test_without_a_hole_there_is_one_sentence(spindle: Scene) -> None:
    result = calibrate(spindle)
    assert not {*OF_THE_JET} & {*result.quantities}
    term = result.models_used[-1]
    assert (term.term, term.model, term.estimated_contribution) == ("gas jet on the ring", "left out", None)
    ratios = crater_range(spindle).ratio
    assert f"{percent(float(ratios.max()))} of the ring's depth" in term.why
    assert ratios.min() < 0.01 < 1 < ratios.max()
    assert math.isnan(float(largest_ratio(spindle, np.array(0.1))))
    with pytest.raises(ValueError, match="gives no gas hole"):
        Crater.of(spindle, 0.25)
