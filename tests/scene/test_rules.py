"""The rules at their very limits: what is allowed is allowed up to there, and not beyond."""

from __future__ import annotations

import math

import pytest

from ringbalance.scene.models import Bend
from ringbalance.scene.rules import shape as shape_rules
from ringbalance.scene.rules import working as working_rules
from ringbalance.scene.rules.finding import Finding

BENDS = (Bend(angle=1.5, radius=0.004), Bend(angle=1.0, radius=0.002))


@pytest.mark.parametrize(
    "finding",
    [
        shape_rules.radii_in_order(0.03, 0.03),
        shape_rules.plates_leave_room(0.03, 0.03, math.pi),
        shape_rules.chamber_has_depth(0.03, 0.03 * (1 + 0.9e-8)),
        shape_rules.fill_has_depth(2e-9, 0.0205, 0.0445),
        shape_rules.chamber_wide_enough(1.99e-3, 0.0, 0.01, 0.05),
        shape_rules.chamber_wide_enough(0.1985, 0.0099, 0.1, 0.2),
        shape_rules.port_in_chamber(0.02, 0.02, 0.04),
        shape_rules.hump_in_disc(0.04, 0.04),
        shape_rules.hump_inside_port(0.04, 0.04),
        shape_rules.bore_fits_bends(0.0041, BENDS),
        shape_rules.bore_fits_chamber(0.0201, 0.01, 0.02, 0.04),
        shape_rules.roughness_fits_bore(0.001, 0.002),
        shape_rules.length_holds_bends(0.0079, BENDS),
        shape_rules.length_reaches(0.0799, 0.0, 0.04),
        shape_rules.fills_share_the_liquid(0.2501, 0.5),
        working_rules.liquid_stays_liquid(1e5, 1e5),
        working_rules.temperature_below_boiling(373.0, 1e5, 1e5),
        working_rules.gas_times_in_order(0.1, 0.1),
        working_rules.limit_above_noise(1e-8, 1e-8),
        working_rules.sequence_complete(("A", "C", "B", "E"), 4),
    ],
)
def test_at_or_beyond_the_limit_is_found(finding: Finding | None) -> None:
    assert finding is not None
    assert finding.problem
    assert finding.allowed


@pytest.mark.parametrize(
    "finding",
    [
        shape_rules.radii_in_order(0.0299, 0.03),
        shape_rules.plates_leave_room(0.0299, 0.03, math.pi),
        shape_rules.chamber_has_depth(0.03, 0.03 * (1 + 1.1e-8)),
        shape_rules.fill_has_depth(3e-8, 0.0205, 0.0445),
        shape_rules.chamber_wide_enough(2.01e-3, 0.0, 0.01, 0.05),
        shape_rules.chambers_fit(math.pi / 2, 4),
        shape_rules.chambers_fit(1.5708, 4),
        shape_rules.fills_share_the_liquid(0.15, 0.3),
        shape_rules.port_in_chamber(0.04, 0.02, 0.04),
        shape_rules.bore_fits_bends(0.004, BENDS),
        shape_rules.bore_fits_chamber(0.02, 0.01, 0.02, 0.04),
        shape_rules.bore_fits_bends(1.0, ()),
        shape_rules.roughness_fits_bore(0.0, 0.002),
        shape_rules.length_holds_bends(0.008, BENDS),
        shape_rules.length_reaches(0.08, 0.0, 0.04),
        shape_rules.length_reaches_over_hump(0.08, math.pi, 0.04, 0.01),
        shape_rules.entrance_has_radius(0.0, "sharp"),
        working_rules.liquid_stays_liquid(0.0, 1e5),
        working_rules.period_covers_lag(0.1, 0.1),
        working_rules.trial_time_executed(0.1, 0.1, 0.2),
        working_rules.trial_time_executed(0.2, 0.1, 0.2),
        working_rules.steps_in_order(0.1, 0.1),
        working_rules.sequence_complete(("D", "C", "B", "A"), 4),
    ],
)
def test_up_to_the_limit_is_allowed(finding: Finding | None) -> None:
    assert finding is None


def test_plates_close_where_the_opening_angle_vanishes() -> None:
    """asin(t/R1) = theta/2 at the limit that the message names."""
    for angle in (0.3, math.pi / 2, math.pi):
        limit = 0.02 * math.sin(angle / 2)
        assert shape_rules.plates_leave_room(limit * (1 + 1e-12), 0.02, angle) is not None
        assert shape_rules.plates_leave_room(limit * (1 - 1e-12), 0.02, angle) is None
        assert math.asin(limit / 0.02) == pytest.approx(angle / 2, rel=1e-7)
