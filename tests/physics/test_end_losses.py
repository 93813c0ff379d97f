"""Laminar losses of the tube's ends: exact limits, fresh solutions against the table, its promises."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import resources

import numpy as np
import pytest
from end_losses_table import EndSettings, end_loss_times_reynolds, run_path
from flow_at_points import probe
from fluids.fittings import entrance_sharp, exit_normal
from hypothesis import given
from hypothesis import strategies as st

from ringbalance.physics.results import StatusCode
from ringbalance.physics.tube.local_losses import _end_loss, _end_table
from ringbalance.verification.navier_stokes.flow import FlowSystem
from ringbalance.verification.navier_stokes.newton import FlowSolution
from ringbalance.verification.navier_stokes.tube import (
    End,
    EndMesh,
    solve_end,
)


def _cells(end: End) -> EndMesh:
    return EndMesh(cells_per_fold=1.3, tube=40.0 if end == "entrance" else 6.0, tube_cell=2.0)


@cache
def _system(end: End) -> FlowSystem:
    return _cells(end).system(end=end)


@cache
def _creeping(end: End) -> FlowSolution:
    return solve_end(system=_system(end), reynolds=0.0)


def _loss(end: End, flow: FlowSolution, share: float = 0.9) -> float:
    return end_loss_times_reynolds(
        system=_system(end), solution=flow, end=end, cells=_cells(end), share=share
    )


def test_creeping_flow_is_reversible_and_near_the_orifice() -> None:
    entrance, leaving = (_loss(end, _creeping(end)) for end in ("entrance", "exit"))
    assert entrance == pytest.approx(leaving, rel=1e-5)
    # A hole without length costs 12 pi/Re in all (Sampson 1891); a tube's two ends nearly the same
    # (Dagan, Weinbaum and Pfeffer, J. Fluid Mech. 115 (1982) 505).
    assert entrance + leaving == pytest.approx(12 * np.pi, rel=0.02)


def entry_length(*, system: FlowSystem, solution: FlowSolution, cells: EndMesh, share: float = 0.99) -> float:
    """Way over the bore on which the velocity on the axis reaches a share of 2 U; the last crossing."""
    x = np.geomspace(1e-2, 0.95 * cells.tube, 1500)
    axis = probe(system=system, solution=solution, points=np.stack([x, np.zeros_like(x)]))[0]
    below = np.flatnonzero(axis < 2 * share)
    if below.size == 0:
        return float(x[0])
    last = min(int(below[-1]), x.size - 2)
    rise = (2 * share - axis[last]) / (axis[last + 1] - axis[last])
    return float(x[last] + rise * (x[last + 1] - x[last]))


def test_entrance_loss_and_entry_length_at_reynolds_60() -> None:
    flow = solve_end(system=_system("entrance"), reynolds=60.0, start=_creeping("entrance"))
    assert flow.status.ok
    found = _end_loss("entrance", 60.0)
    assert _loss("entrance", flow) / 60 == pytest.approx(float(found.value), rel=5e-3)
    length = entry_length(system=_system("entrance"), solution=flow, cells=_cells("entrance"))
    # 0.6/(1 + 0.035 Re) + 0.056 Re: Atkinson et al., cited by Shah and London (1978), for a uniform inflow.
    assert length == pytest.approx(0.056 * 60 + 0.6 / (1 + 0.035 * 60), rel=0.25)


def test_exit_loss_at_reynolds_7() -> None:
    flow = solve_end(system=_system("exit"), reynolds=7.0, start=_creeping("exit"))
    assert _loss("exit", flow) / 7 == pytest.approx(float(_end_loss("exit", 7.0).value), abs=5e-3)


def test_both_ends_cost_about_2_3_laminar_and_1_57_turbulent() -> None:
    laminar = _end_loss("entrance", 1000.0).value + _end_loss("exit", 1000.0).value
    assert float(laminar) == pytest.approx(2.3, abs=0.03)
    assert entrance_sharp() + exit_normal() == pytest.approx(1.57, abs=0.01)


def test_the_committed_table_is_whole_and_fine_enough() -> None:
    path = resources.files("ringbalance.physics") / "data" / "end_losses.csv"
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    body = "".join(line for line in lines if not line.startswith("#"))
    head = dict(line[2:].rstrip().split(": ", 1) for line in lines if line.startswith("#") and ": " in line)
    assert head["data_sha256"] == hashlib.sha256(body.encode()).hexdigest()
    for end in ("entrance", "exit"):
        assert _end_table(end).interpolation_error < 5e-3
    reynolds = np.geomspace(1.0, 2000.0, 50)
    assert np.all(_end_loss("entrance", reynolds).uncertainty < 0.01 * _end_loss("entrance", reynolds).value)
    assert np.all(_end_loss("exit", reynolds).uncertainty < 0.003 + 0.03 / reynolds)


@pytest.mark.heavy
@pytest.mark.parametrize("end", ["entrance", "exit"])
def test_the_table_comes_out_again(end: End) -> None:
    settings = EndSettings()
    points = [a for _, a in settings.points()]
    found = run_path(end=end, level=0, settings=settings, points=points)
    stored = [float(row["coarse"]) for row in _end_table(end).rows]
    np.testing.assert_allclose(found, stored, rtol=1e-5, atol=1e-4)


@pytest.mark.heavy
@pytest.mark.parametrize(("end", "reynolds"), [("entrance", 730.0), ("exit", 330.0)])
def test_unseen_reynolds_numbers_in_a_larger_domain(end: End, reynolds: float) -> None:
    cells = EndMesh(
        cells_per_fold=2.2, reservoir=100.0, edge_cell=3e-5, tube=200.0 if end == "entrance" else 10.0
    )
    system, flow = cells.system(end=end), None
    for step in (0.0, 10.0, 40.0, 120.0, reynolds):
        flow = solve_end(system=system, reynolds=step, start=flow)
        assert flow.status.ok
    assert flow is not None
    found = end_loss_times_reynolds(system=system, solution=flow, end=end, cells=cells) / reynolds
    table = _end_loss(end, reynolds)
    assert found == pytest.approx(float(table.value), rel=0.01 if end == "entrance" else 0, abs=2e-3)


@given(reynolds=st.floats(1e-3, 2000.0), growth=st.floats(1.01, 5.0))
def test_losses_are_finite_and_the_entrance_falls_with_reynolds(reynolds: float, growth: float) -> None:
    pair = [reynolds, min(growth * reynolds, 2000.0)]
    entrance, leaving = _end_loss("entrance", pair), _end_loss("exit", pair)
    assert entrance.status.ok
    assert leaving.status.ok
    assert entrance.value[0] >= entrance.value[1] - 2e-3
    for estimate in (entrance, leaving):
        assert np.all(np.isfinite(estimate.value))
        assert np.all(estimate.uncertainty > 0)


def test_above_the_table_the_answer_says_so() -> None:
    found = _end_loss("entrance", [100.0, 5000.0])
    assert found.status.code is StatusCode.OUT_OF_RANGE
    assert found.uncertainty[1] > 0.25 > found.uncertainty[0]


def test_the_half_width_does_not_step_where_the_table_ends() -> None:
    """Errors of k are a share of it, and a step of k would make the head fall where the velocity grows."""
    for end in ("entrance", "exit"):
        re = np.linspace(1500, 2600, 2001)
        width = _end_loss(end, re).uncertainty
        assert np.max(np.abs(np.diff(width))) < 1e-3
        assert width[-1] - width[0] > 0.25
