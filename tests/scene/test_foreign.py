"""Numbers of other packages: by small stand-ins, and by pint and uncertainties themselves where installed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.results.rows import Quantity
from ringbalance.scene.faults import SceneError
from ringbalance.scene.uncertain import NORMAL_95

FACTORS = {("mm", "m"): 1e-3, ("bar", "Pa"): 1e5, ("", "dimensionless"): 1.0}


@dataclass
class Measured:
    """As pint's quantities convert."""

    magnitude: Any
    unit: str

    def to(self, unit: str) -> Measured:
        if (self.unit, unit) not in FACTORS:
            raise TypeError(f"cannot convert {self.unit} to {unit}")
        factor = FACTORS[self.unit, unit]
        if isinstance(self.magnitude, Uncertain) and self.magnitude.nominal_value is not None:
            return Measured(
                Uncertain(self.magnitude.nominal_value * factor, self.magnitude.std_dev * factor), unit
            )
        return Measured(self.magnitude * factor, unit)


@dataclass
class Uncertain:
    """As numbers of uncertainties are read."""

    nominal_value: float | None
    std_dev: float


def scene() -> rb.Scene:
    found = rb.load_scene(rb.bundled_scene("six_chamber"))
    assert isinstance(found, rb.Scene)
    return found


def test_a_scene_takes_units_and_deviations() -> None:
    wider = scene().with_values({"tube.bore": Measured(1.2, "mm"), "rotor.speed": Uncertain(600.0, 2.0)})
    assert wider.tube.bore == pytest.approx(1.2e-3, rel=1e-15)
    assert wider.rotor.speed == 600.0
    widths = {each.quantity: each.half_width for each in wider.uncertainty}
    assert widths["speed"] == pytest.approx(2.0 * NORMAL_95)
    both = scene().with_values({"tube.bore": Measured(Uncertain(1.2, 0.01), "mm")})
    assert {each.quantity: each.half_width for each in both.uncertainty}["bore"] == pytest.approx(
        1e-5 * NORMAL_95
    )


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"tube.bore": Measured(1.2, "bar")}, "bore"),
        ({"run.seed": Uncertain(3.0, 1.0)}, "seed"),
    ],
)
def test_another_dimension_and_what_cannot_be_uncertain_are_errors(
    values: dict[str, object], told: str
) -> None:
    with pytest.raises(SceneError, match=told):
        scene().with_values(values)


def test_a_law_takes_units() -> None:
    law = rb.paper_law(scene())
    plain = law.evaluate(fill_ratio=[0.2, 0.3], gas_pressure=4e5, primed=True)
    pressure: Any = Measured(4.0, "bar")
    fill: Any = Measured(np.array([0.2, 0.3]), "")
    assert np.array_equal(
        law.evaluate(fill_ratio=fill, gas_pressure=pressure, primed=True).velocity, plain.velocity
    )
    length: Any = Measured(4.0, "mm")
    with pytest.raises(ValueError, match="Pa"):
        law.evaluate(fill_ratio=0.2, gas_pressure=length)


def test_a_result_gives_both() -> None:
    row = Quantity(key="k", name="n", value=2.0, unit="m", lower=1.9, upper=2.1)
    assert row.with_unit(Measured) == Measured(2.0, "m")
    found = row.with_deviation(Uncertain)
    assert (found.nominal_value, found.std_dev) == (2.0, pytest.approx(0.1 / NORMAL_95))
    assert Quantity(key="k", name="n", value=2.0).with_deviation(Uncertain).std_dev == 0.0


def test_pint_and_uncertainties_themselves() -> None:
    pint, uncertainties = pytest.importorskip("pint"), pytest.importorskip("uncertainties")
    units = pint.UnitRegistry()
    values = {
        "tube.bore": units.Quantity(uncertainties.ufloat(1.2, 0.01), "mm"),
        "liquid.density": units.Quantity(0.99, "g/cm^3"),
        "rotor.influence_coefficient": units.Quantity(0.02, "um/(g*mm)"),
        "gas.pressure": units.Quantity(4.0, "bar"),
    }
    changed = scene().with_values(values)
    assert (changed.tube.bore, changed.liquid.density) == pytest.approx((1.2e-3, 990.0))
    assert (changed.rotor.influence_coefficient, changed.gas.pressure) == pytest.approx((0.02, 4e5))
    with pytest.raises(SceneError, match="bore"):
        scene().with_values({"tube.bore": units.Quantity(1.0, "kg")})
    row = Quantity(key="k", name="n", value=2.0, unit="m", lower=1.9, upper=2.1)
    assert row.with_unit(units.Quantity).to("mm").magnitude == 2000.0
    assert row.with_deviation(uncertainties.ufloat).std_dev == pytest.approx(0.1 / NORMAL_95)
