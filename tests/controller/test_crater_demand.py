"""What a scene requires of the gas jet, judged at the injections of drawn devices."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ringbalance.controller.balancer import Draws, balancer_of, quick_balancer
from ringbalance.controller.judging.judge import judged_all
from ringbalance.controller.liquid_ring.offers import remedies_of
from ringbalance.reduced_model.crater import Crater
from ringbalance.scene import SceneError
from ringbalance.scene.models import Scene
from scenes import bundled

HOLE = {"disc.gas_hole_diameter": "3 mm", "disc.gas_hole_radius": "30 mm", "requirement.crater": 0.8}


@pytest.fixture(scope="module")
def spindle() -> Scene:
    return bundled("grinding_spindle")


@pytest.fixture(scope="module")
def balancer(spindle: Scene) -> Any:
    return balancer_of(spindle.with_values(HOLE))


def test_every_device_is_judged_at_the_lowest_fill_of_its_injections(balancer: Any) -> None:
    together, traced = (balancer.run({}, Draws.first(6), trace=each) for each in (False, True))
    assert traced.crater == pytest.approx(together.crater, rel=1e-4)
    for place, result in enumerate(traced.traced):
        fill = min(injection.fill_before for injection in result.run.injections)
        assert traced.crater[place] == float(Crater.of(result.run.scene, fill).ratio)
    assert np.ptp(together.crater) > 0.1


def test_a_leak_takes_nothing_from_the_supply_of_the_jet(spindle: Scene) -> None:
    leaking = balancer_of(spindle.with_values({**HOLE, "gas.leak_to_ambient": "0.15 l/(s*bar)"}))
    together, traced = (leaking.run({}, Draws.first(4), trace=each) for each in (False, True))
    assert traced.crater == pytest.approx(together.crater, rel=1e-4)


def test_the_demand_counts_beside_the_settling_time(balancer: Any, spindle: Scene) -> None:
    (result,) = judged_all(balancer, [{}], most=64)
    settles, crater = result.demands
    assert (crater.code, crater.required, crater.sense) == ("crater", 0.8, "at most")
    outcomes = result.outcomes
    expected = settles.met(outcomes) & (outcomes.crater <= 0.8)
    assert result.meets.tolist() == expected.tolist()
    assert 0 < np.mean(crater.met(outcomes)) < 1
    assert result.crater_reached == pytest.approx(np.quantile(outcomes.crater, 0.9))
    # The same devices without the keys: only the crater is not known.
    bare = balancer_of(spindle).run({}, Draws.first(6))
    held = balancer.run({}, Draws.first(6))
    assert np.isnan(bare.crater).all()
    assert bare.settling_time.tolist() == held.settling_time.tolist()
    assert bare.final_amplitude.tolist() == held.final_amplitude.tolist()


def test_remedies_are_a_larger_or_turned_hole_and_a_slower_valve(balancer: Any, spindle: Scene) -> None:
    codes = {each.code for each in balancer.remedies()}
    assert {"gas_hole", "turned_gas_hole", "slower_valve"} <= codes
    assert not {"gas_hole", "turned_gas_hole", "slower_valve"} & {
        each.code for each in remedies_of(spindle, balancer.model)
    }
    axial = balancer.on_scene(balancer.scene.with_values({"disc.gas_hole_direction": "axial"}))
    worst = [each.run({}, Draws.first(4)).crater.max() for each in (balancer, axial)]
    assert worst[1] < 0.5 * worst[0]


def test_a_design_is_held_to_the_crater_too(spindle: Scene) -> None:
    """As `design` runs it: the fastest valve at hand digs through the ring, and meets the demand no more."""
    met = []
    for conductance in ("0.3 l/(s*bar)", "2.3 l/(s*bar)"):
        quick = quick_balancer(spindle.with_values({**HOLE, "gas.conductance": conductance}))
        crater = next(each for each in quick.demands() if each.code == "crater")
        met.append(np.mean(crater.met(quick.run({}, Draws.first(8)))))
    assert met[0] > met[1] == 0.0


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"requirement.crater": 0.5}, "crater has no meaning without it"),
        ({"disc.gas_hole_diameter": "2 mm"}, "gas_hole_diameter has no meaning without it"),
        ({"disc.gas_hole_radius": "30 mm"}, "gas_hole_radius has no meaning without it"),
        ({**HOLE, "disc.gas_hole_radius": "40 mm"}, "the liquid covers the gas inlet"),
        ({**HOLE, "disc.gas_hole_radius": "20 mm"}, "lies outside the chamber"),
        ({**HOLE, "disc.gas_hole_diameter": "30 mm"}, "larger than the chamber"),
        ({**HOLE, "gas.inlet_radius": "31 mm"}, "gas enters the chambers at gas.inlet_radius"),
    ],
)
def test_a_hole_that_cannot_be_is_refused(spindle: Scene, values: dict[str, Any], problem: str) -> None:
    with pytest.raises(SceneError, match=problem):
        spindle.with_values(values)


def test_a_hole_takes_its_radius_from_the_inlet_and_blows_outward(spindle: Scene) -> None:
    scene = spindle.with_values({"disc.gas_hole_diameter": "2 mm", "gas.inlet_radius": "30 mm"})
    assert isinstance(scene, Scene)
    assert (scene.disc.gas_hole_radius, scene.disc.gas_hole_direction) == (0.03, "outward")
    assert scene.origin_of("disc.gas_hole_direction") == "default"
