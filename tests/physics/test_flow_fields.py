"""Fields to draw: they carry the flow rate, keep their symmetry and walls, and agree with the tables."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from ringbalance.physics.results import StatusCode
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.verification.navier_stokes.flow_fields import (
    LARGEST_KL,
    LARGEST_ROTATION,
    FlowField,
    end_field,
    section_field,
)

section = cache(section_field)
end = cache(end_field)
"""Fields that several tests look at are found once; none changes them."""


def _areas(flow: FlowField) -> FloatArray:
    (x0, y0), (x1, y1), (x2, y2) = (flow.points[:, flow.triangles[:, i]] for i in range(3))
    return np.asarray(((x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)) / 2, dtype=np.float64)


def _mean(flow: FlowField, values: FloatArray) -> float:
    """Mean over the section, by straight triangles."""
    areas = _areas(flow)
    return float(areas @ values[flow.triangles].mean(axis=1) / areas.sum())


@pytest.mark.parametrize(("re", "rotation"), [(150.0, 47.0), (1e-3, 100.0), (200.0, 0.0), (700.0, 700.0)])
def test_the_section_agrees_with_the_table(re: float, rotation: float) -> None:
    flow = section(reynolds=re, rotation_reynolds=rotation)
    expected = rotating_friction_ratio(reynolds=re, rotation_reynolds=rotation).value
    assert flow.status.ok
    assert (flow.reynolds, flow.rotation_reynolds) == (re, pytest.approx(rotation))
    assert flow.friction_ratio == pytest.approx(float(expected), rel=2e-3)
    assert _mean(flow, flow.velocity[2]) == pytest.approx(1.0, rel=0.02)
    assert _areas(flow).sum() == pytest.approx(np.pi / 4, rel=0.003)
    assert np.all(_areas(flow) > 0)


def test_the_section_is_symmetric_and_still_at_the_wall() -> None:
    flow = section(reynolds=150.0, rotation_reynolds=47.0)
    order, mirrored = (np.lexsort(np.round(p, 9)) for p in (flow.points, flow.points * [[1.0], [-1.0]]))
    assert np.allclose(flow.points[:, order], (flow.points * [[1.0], [-1.0]])[:, mirrored])
    assert np.array_equal(flow.velocity[2][order], flow.velocity[2][mirrored])
    assert np.allclose(flow.velocity[1][order], -flow.velocity[1][mirrored])
    assert np.allclose(flow.stream_function[order], -flow.stream_function[mirrored])
    wall = np.hypot(*flow.points) > 0.5 - 1e-9
    assert np.all(flow.velocity[2][wall] == 0.0)
    assert np.all(flow.velocity[:, wall] == 0.0)
    assert np.all(flow.stream_function[wall] == 0.0)


def test_the_sections_vortices_turn_as_the_coriolis_force_has_them() -> None:
    # Liquid faster than the mean is driven against y = z cross x, and returns along the walls.
    flow = section(reynolds=150.0, rotation_reynolds=47.0)
    assert _mean(flow, flow.velocity[2] * flow.velocity[0]) < -0.02
    assert abs(_mean(flow, flow.velocity[0])) < 1e-3
    assert _mean(flow, flow.velocity[2] * flow.points[0]) < -0.01


@pytest.mark.parametrize(("re", "rotation"), [(7500.0, 2356.0), (1e6, 1e6), (1.0, 1e7)])
def test_beyond_the_range_the_nearest_section_is_given_and_said(re: float, rotation: float) -> None:
    flow = section(reynolds=re, rotation_reynolds=rotation)
    assert flow.status.code is StatusCode.OUT_OF_RANGE
    assert flow.rotation_reynolds / flow.reynolds == pytest.approx(rotation / re)
    assert flow.reynolds * flow.rotation_reynolds <= LARGEST_KL * (1 + 1e-9)
    assert flow.rotation_reynolds <= LARGEST_ROTATION * (1 + 1e-9)
    table = rotating_friction_ratio(reynolds=flow.reynolds, rotation_reynolds=flow.rotation_reynolds)
    assert flow.friction_ratio == pytest.approx(float(table.value), rel=3e-3)


def _wall(flow: FlowField, inside: float) -> BoolArray:
    """Nodes on the tube's wall and on the plane it ends in; `inside` is the sign of x in the tube."""
    x, r = flow.points
    return np.asarray((np.abs(x) < 1e-12) & (r >= 0.5) | (x * inside > 0) & (np.abs(r - 0.5) < 1e-12))


@pytest.mark.parametrize("re", [1.0, 200.0])
def test_the_ends_carry_the_flow_and_are_still_at_the_wall(re: float) -> None:
    for flow, inside in ((end("entrance", reynolds=re), 1.0), (end("exit", reynolds=re), -1.0)):
        assert flow.status.ok
        assert np.all(_areas(flow) > 0)
        wall, axis = _wall(flow, inside), flow.points[1] == 0.0
        assert np.all(flow.velocity[:, wall] == 0.0)
        assert np.allclose(flow.stream_function[wall], 1 / 8)
        assert np.all(flow.stream_function[axis] == 0.0)
        assert np.all(flow.velocity[1, axis] == 0.0)
        deep = flow.points[0] == (flow.points[0] * inside).max() * inside
        radius, axial = flow.points[1, deep], flow.velocity[0, deep]
        if re == 1.0:
            # So slow that flow is developed at the edge of the picture.
            assert np.allclose(axial, 2 * (1 - 4 * radius**2), atol=0.02)
