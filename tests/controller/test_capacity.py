"""What is said where capacity decides a verdict, beside hand formulas of the paper's disc."""

from __future__ import annotations

import pytest
from paper_disc import CREST, DENSITY, INFLUENCE, VAPOUR, arm, crest_volume, level, pressure

from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.liquid_ring.capacity import beyond_capacity, running_fill
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio
from ringbalance.scene.models import Scene

_TOTAL = 0.5


def test_a_pulse_at_the_residual_fill_sends_over_what_lies_behind_the_middle_of_the_crest(
    paper_scene: Scene,
) -> None:
    balancer = LiquidRingBalancer(paper_scene)
    ended = ("settled", "capacity_exceeded", "capacity_exceeded")
    result, decides = beyond_capacity(paper_scene, balancer.model, ended)
    # Two of three are more than the tenth that may fail.
    assert (decides.code, decides.values["count"]) == ("capacity_decides", 2)
    assert "ringbalance design" in decides.text
    few = beyond_capacity(paper_scene, balancer.model, (*["settled"] * 18, *ended[1:]))
    assert [each.code for each in few] == ["capacity_creeps"]
    least = residual_fill_ratio(paper_scene, law=balancer.model.flow)
    by_hand = DENSITY * crest_volume() * (arm(level(least)) + arm(level(_TOTAL - least)))
    assert result.code == "capacity_creeps"
    assert result.values["count"] == 2
    assert result.values["moment"] == pytest.approx(by_hand, rel=5e-3)
    # An own plant, with its own flow, crept by 0.036 um a pulse.
    assert result.values["vibration"] == pytest.approx(INFLUENCE * by_hand, rel=1e-2)
    assert result.values["vibration"] == pytest.approx(0.036e-6, rel=0.04)


@pytest.mark.parametrize("gas", [0.42e6, 0.425e6])
def test_a_long_injection_goes_on_below_the_stall_until_the_column_parts_over_a_cavity(
    paper_scene: Scene, gas: float
) -> None:
    """It lasts while p + P(x) exceeds D_m + p_c, at most with p_c of vapour; a new one starts while p + P(x)
    exceeds D_m.  Half the vapour's pressure, which runs take, would leave less: it is no upper end."""
    weak = paper_scene.with_values({"gas.pressure": gas})
    assert isinstance(weak, Scene)
    model = LiquidRingBalancer(weak).model
    fill = running_fill(weak, model)
    # The gas itself weighs a little on the liquid.
    assert pressure(CREST) + VAPOUR - pressure(level(fill)) == pytest.approx(gas, rel=5e-3)
    (result,) = beyond_capacity(weak, model, ("stalled",))
    assert result.code == "stall_passed"
    assert result.values["reached"] > 1.2 * result.values["counted"]  # type: ignore[operator]


def test_nothing_is_said_where_no_device_ends_for_want_of_capacity(paper_scene: Scene) -> None:
    assert not [*beyond_capacity(paper_scene, LiquidRingBalancer(paper_scene).model, ("settled", "hovering"))]
