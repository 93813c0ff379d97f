"""The rotating section against exact limits, its table against fresh solutions and its own promises."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rotating_friction_table import columns, run_column, settings_hash, table_settings

from ringbalance.physics.results import Status, StatusCode
from ringbalance.physics.tube.rotation_table import (
    _friction_table,
    _ito_nanbu_laminar,
    rotating_friction_ratio,
    rotation_table_covers,
    slow_first,
)
from ringbalance.verification.navier_stokes.flow import FlowSystem
from ringbalance.verification.navier_stokes.newton import FlowSolution, NewtonSettings, StepRule, follow
from ringbalance.verification.navier_stokes.tube import (
    POISEUILLE_GRADIENT,
    DuctMesh,
    SectionMesh,
    developed_section,
    friction_ratio,
    march_section,
    solve_section,
    solve_section_without_inertia,
)


@cache
def _system(around: int = 8, wall_ratio: float = 15.0) -> FlowSystem:
    return SectionMesh(around=around, across=3 * around // 2, wall_ratio=wall_ratio).system()


def _followed(kl: float, s: float, around: int) -> float:
    """F at a point, followed from slow rotation."""
    system = _system(around)

    def solve(a: float, start: FlowSolution | None) -> FlowSolution:
        newton = NewtonSettings(max_iterations=12)
        return solve_section(system=system, kl=300 * np.expm1(a), s=s, start=start, settings=newton)

    rule = StepRule(first=0.8, largest=1.2, smallest=0.01)
    path = follow(
        solve=solve, start=solve(0.5, None), start_at=0.5, targets=[float(slow_first(kl))], rule=rule
    )
    assert path.status.ok
    return friction_ratio(path.solutions[0])


def test_a_path_recovers_from_steps_that_fail() -> None:
    system, taken = _system(4), [0.0]

    def solve(kl: float, start: FlowSolution | None) -> FlowSolution:
        found = solve_section(system=system, kl=kl, s=1.0, start=start)
        if kl - taken[-1] > 40.0:
            return replace(found, status=Status(code=StatusCode.NOT_CONVERGED, text="too far"))
        taken.append(kl)
        return found

    start = solve_section(system=system, kl=0.0, s=1.0)
    rule = StepRule(first=100.0, smallest=1.0)
    path = follow(solve=solve, start=start, start_at=0.0, targets=[100.0], rule=rule)
    assert path.status.ok
    assert path.failures >= 2
    short = StepRule(first=100.0, smallest=60.0)
    taken[:] = [0.0]
    stuck = follow(solve=solve, start=start, start_at=0.0, targets=[100.0], rule=short)
    assert stuck.status.code is StatusCode.NOT_CONVERGED
    assert stuck.solutions == ()


def test_the_committed_table_is_whole() -> None:
    path = resources.files("ringbalance.physics") / "data" / "rotating_friction.csv"
    text = path.read_text(encoding="utf-8")
    assert len(text.encode()) < 200_000
    lines = text.splitlines(keepends=True)
    body = "".join(line for line in lines if not line.startswith("#"))
    head = dict(line[2:].rstrip().split(": ", 1) for line in lines if line.startswith("#") and ": " in line)
    assert head["data_sha256"] == hashlib.sha256(body.encode()).hexdigest()
    assert head["settings_sha256"] == settings_hash(table_settings())
    plain = json.loads(json.dumps(table_settings().plain()))
    assert json.loads(head["settings"]) == plain


def test_the_table_is_fine_enough() -> None:
    table = _friction_table()
    inner = [r for r in table.rows if r["table"] == "slow" and float(r["a"]) <= slow_first(1e6)]
    assert max(float(r["uncertainty"]) / float(r["fine"]) for r in inner) < 1e-3
    assert table.interpolation_error < 2e-3
    assert table.edge_interpolation_error < 1e-2


@pytest.mark.parametrize(("a", "b"), [(3, 4), (9, 10)])
def test_points_of_the_table_come_out_again(a: int, b: int) -> None:
    settings, table = table_settings(), _friction_table()
    place = (settings.slow_a[a], settings.slow_b[b])
    row = next(r for r in table.rows if r["table"] == "slow" and (float(r["a"]), float(r["b"])) == place)
    kl, s = 300 * np.expm1(place[0]), place[1] / (1 - place[1])
    assert _followed(kl, s, 8) == pytest.approx(float(row["coarse"]), rel=2e-6)


@pytest.mark.heavy
@pytest.mark.parametrize("index", range(len(columns(table_settings()))))
def test_every_point_of_the_table_comes_out_again(index: int, tmp_path: Path) -> None:
    settings, table = table_settings(), _friction_table()
    column = columns(settings)[index]
    assert run_column(column=column, folder=tmp_path, settings=settings) == len(column.points)
    assert run_column(column=column, folder=tmp_path, settings=settings) == 0
    stored = [row for row in table.rows if row["table"] == column.table and float(row["b"]) == column.b]
    found = [json.loads(path.read_text(encoding="utf-8")) for path in tmp_path.glob("*.json")]
    expected = [[float(row[name]) for name in ("coarse", "medium", "fine")] for row in stored]
    np.testing.assert_allclose(sorted(found), sorted(expected), rtol=1e-5)


@pytest.mark.parametrize(("reynolds", "rotation"), [(173.0, 61.0), (40.0, 170.0), (600.0, 190.0)])
def test_unseen_points_lie_within_half_a_percent(reynolds: float, rotation: float) -> None:
    fresh = _followed(reynolds * rotation, rotation / reynolds, 6)
    found = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=rotation)
    assert found.status.ok
    assert float(found.value) == pytest.approx(fresh, rel=2e-3)
    assert float(found.uncertainty) < 5e-3 * float(found.value)


@pytest.mark.heavy
@pytest.mark.parametrize("seed", range(6))
def test_many_unseen_points_lie_within_half_a_percent(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kl, s = 10 ** rng.uniform(2.5, 6.0), rng.uniform(0.0, 5.0)
    found = rotating_friction_ratio(reynolds=np.sqrt(kl / s), rotation_reynolds=np.sqrt(kl * s))
    assert float(found.value) == pytest.approx(_followed(kl, s, 14), rel=5e-3)


@given(reynolds=st.floats(1.0, 3000.0), rotation=st.floats(0.1, 3000.0), growth=st.floats(1.02, 3.0))
def test_friction_grows_with_rotation_and_never_falls_below_rest(
    reynolds: float, rotation: float, growth: float
) -> None:
    pair = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=[rotation, growth * rotation])
    assert np.all(pair.value >= 1 - 1e-5)
    assert pair.value[1] > pair.value[0] - 1e-5
    assert np.all(np.isfinite(pair.uncertainty))
    assert np.all(pair.uncertainty >= 0)


def test_the_two_rectangles_join_smoothly() -> None:
    s = np.geomspace(1.5, 8.0, 400)
    for rotation in (20.0, 300.0, 3000.0):
        value = np.log(rotating_friction_ratio(reynolds=rotation / s, rotation_reynolds=rotation).value)
        slope = np.diff(value) / np.diff(np.log(s))
        assert np.abs(np.diff(slope)).max() < 2e-3


def test_outside_the_table_the_answer_is_wide_and_says_so() -> None:
    found = rotating_friction_ratio(reynolds=[100.0, 1e5, 10.0], rotation_reynolds=[100.0, 1e3, 1e6])
    assert found.status.code is StatusCode.OUT_OF_RANGE
    assert np.all(np.isfinite(found.value))
    covered = rotation_table_covers(reynolds=[100.0, 1e5, 10.0], rotation_reynolds=[100.0, 1e3, 1e6])
    np.testing.assert_array_equal(covered, [True, False, False])
    assert np.all(found.uncertainty[~covered] > 0.25 * found.value[~covered])
    assert found.uncertainty[0] < 0.01 * found.value[0]


def test_flow_that_fluctuates_lies_inside_the_interval() -> None:
    # A square duct needs 19 % more than its steady solution at Kl = 1.8e7, S = 0.5 (measured).
    kl = np.array([2.9e6, 3.1e6, 0.999e7, 1.001e7, 1.8e7, 1e9])
    found = rotating_friction_ratio(reynolds=np.sqrt(kl / 0.5), rotation_reynolds=np.sqrt(kl * 0.5))
    relative = found.uncertainty / found.value
    assert relative[0] < 0.01
    assert np.all(np.diff(relative) >= 0)
    assert relative[3] - relative[2] < 0.01
    assert relative[4] > 0.188
    assert relative[5] == pytest.approx(0.3, abs=0.01)


@pytest.mark.heavy
def test_flow_solved_in_time_beyond_the_table_lies_inside_the_interval() -> None:
    reynolds, rotation = 4485.0, 2348.0
    system = SectionMesh(around=7, across=11, wall_ratio=15.0).system()
    flow = march_section(system=system, kl=reynolds * rotation, s=rotation / reynolds, step=8e-7, steps=12500)
    found = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=rotation)
    solved = np.mean(flow[-round(flow.size / 2) :]) / POISEUILLE_GRADIENT
    assert abs(solved - float(found.value)) < float(found.uncertainty)
    assert solved > float(found.value)


@pytest.mark.heavy
def test_what_is_carried_on_beyond_the_table_meets_steady_solutions() -> None:
    rotation, system = 2348.0, SectionMesh(around=10, across=18, wall_ratio=25.0).system()
    for reynolds in (4485.0, 7475.0):
        flow = developed_section(system=system, kl=reynolds * rotation, s=rotation / reynolds)
        found = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=rotation)
        assert float(found.value) == pytest.approx(friction_ratio(flow), rel=0.01)


def test_ito_and_nanbus_formula_holds_for_slow_rotation_only() -> None:
    """Their formula knows Kl alone; S raises friction beyond it."""
    kl = np.geomspace(1e4, 1e6, 9)

    def gap(s: float) -> float:
        value = rotating_friction_ratio(reynolds=np.sqrt(kl / s), rotation_reynolds=np.sqrt(kl * s)).value
        return float(np.abs(_ito_nanbu_laminar(kl=kl) / value - 1).max())

    assert gap(0.05) < 0.03
    assert gap(0.5) < 0.08
    assert gap(2.0) > 0.13


def test_a_flow_that_changes_in_time_settles_at_the_steady_one() -> None:
    system = SectionMesh(around=3, across=4, wall_ratio=5.0).system()
    steady = developed_section(system=system, kl=1e4, s=1.0).driving_gradient
    flow = march_section(system=system, kl=1e4, s=1.0, step=2e-4, steps=1000)
    assert flow[-1] == pytest.approx(steady, rel=1e-4)
    assert abs(flow[5] / steady - 1) > 0.01


@pytest.mark.parametrize(("aspect", "product"), [(1.0, 56.908), (2.0, 62.192), (8.0, 82.34)])
def test_laminar_friction_of_ducts_is_the_exact_series(aspect: float, product: float) -> None:
    """f Re of a rectangular duct; the series is summed here."""
    ratio, odd = 1 / aspect, np.arange(1, 200, 2)
    series = 1 - 192 / np.pi**5 * ratio * np.sum(np.tanh(odd * np.pi / (2 * ratio)) / odd**5)
    exact = 96 / ((1 + ratio) ** 2 * series)
    assert exact == pytest.approx(product, rel=1e-3)
    flow = solve_section_without_inertia(system=DuctMesh(aspect_ratio=aspect).system(), rotation_reynolds=0.0)
    assert 64 * friction_ratio(flow) == pytest.approx(exact, rel=1e-4)
