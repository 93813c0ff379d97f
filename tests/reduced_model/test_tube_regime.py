"""Pressures and regimes of the tube, by hand, for numbers and for arrays alike."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ringbalance.reduced_model.injection.dynamics import PLANT
from ringbalance.reduced_model.tube.flow import column_pressure, column_radius
from ringbalance.reduced_model.tube.regime import (
    ColumnFlow,
    TubeEnds,
    TubePath,
    back_pressure,
    can_flow,
    cavity_pressure,
    cleared,
    column_flow,
    covered,
    crest_margins,
    discharges_openly,
    driving_pressure,
    holds_at_rest,
    priming_pressure,
    stall_pressure,
)
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.compiled import compiled

ENDS = TubeEnds(upstream_gas=5.0, downstream_gas=1.0, upstream_hydrostatic=7.0, downstream_hydrostatic=3.0)
PATH = TubePath(
    density=1e3,
    port_pressure=2.0,
    hump_pressure=9.0,
    trapped=False,
    vapour_pressure=-1.0,
    released=0.0,
    froude_velocity=0.0,
)
TRAPPED, LEVEL = replace(PATH, trapped=True), replace(PATH, hump_pressure=None)
SHALLOW = ENDS._replace(downstream_hydrostatic=1.5)


def root(pressure: Any, where: Any) -> Any:
    return np.where(where, np.sqrt(np.where(where, pressure, 0.0)), 0.0)


def flow_of(path: TubePath, ends: TubeEnds, *, primed: Any) -> ColumnFlow[Any]:
    return column_flow(path, ends, primed=primed, siphon=root, separation=root)


def test_pressures_at_the_ends() -> None:
    assert driving_pressure(PATH, ENDS) == 5 - 1 + 7 - 3
    assert stall_pressure(PATH, ENDS) == 3 - 7
    assert driving_pressure(PATH, ENDS.reversed()) == 1 - 5 + 3 - 7
    assert (back_pressure(PATH, SHALLOW), bool(discharges_openly(PATH, SHALLOW))) == (2.0, True)
    assert not covered(PATH, ENDS._replace(upstream_hydrostatic=1.5))


def test_pressures_at_the_crest() -> None:
    assert crest_margins(PATH, ENDS) == (5 + 1 + 7 - 9, 5 - 1 + 7 - 9)
    assert priming_pressure(PATH, ENDS) == 9 - 7
    assert priming_pressure(TRAPPED, ENDS) == 9 - 7 + (3 - 2)
    # With the downstream port open its gas fills the cavity, and trapped gas displaces nothing.
    assert cavity_pressure(PATH, SHALLOW) == 1.0
    assert priming_pressure(TRAPPED, SHALLOW) == 9 - 7


@pytest.mark.parametrize(
    ("changes", "primed", "velocity", "separated"),
    [
        ({}, True, 2.0, True),
        ({"downstream_hydrostatic": 8.0}, True, math.sqrt(3.0), False),
        ({"downstream_hydrostatic": 11.0}, True, 0.0, False),
        ({"upstream_gas": 2.0, "downstream_gas": 0.5}, False, 0.0, False),
        ({"upstream_gas": 2.0, "downstream_gas": 0.5}, True, 1.0, True),
        ({"upstream_gas": 0.5, "downstream_gas": 0.0}, True, 0.0, False),
        ({"upstream_hydrostatic": 1.5, "upstream_gas": 99.0}, True, 0.0, False),
    ],
    ids=["separated", "siphon", "back pressure", "unprimed", "primed", "column breaks", "port open"],
)
def test_regimes(changes: dict[str, float], primed: bool, velocity: float, separated: bool) -> None:
    flow = flow_of(PATH, ENDS._replace(**changes), primed=primed)
    assert (flow.velocity, flow.separated) == (pytest.approx(velocity), separated)


def test_a_column_at_exact_balance_stays() -> None:
    balanced = ENDS._replace(downstream_hydrostatic=11.0)
    flow = flow_of(PATH, balanced, primed=True)
    assert (flow.velocity, flow.primed) == (0.0, True)
    assert not flow_of(PATH, balanced, primed=False).primed


def test_a_separated_column_over_an_open_port_is_lost() -> None:
    flow = flow_of(PATH, SHALLOW, primed=True)
    assert (flow.separated, flow.primed) == (True, False)


@pytest.mark.parametrize(
    ("froude_velocity", "primed"), [(0.0, True), (0.5, True), (1.0, False), (5.0, False)]
)
def test_a_started_tube_is_primed_once_its_flow_carries_the_gas_out(
    froude_velocity: float, primed: bool
) -> None:
    # Driving 5 - 1 + 7 - 10.5 = 0.5, gas margin 5 + 7 - 9 - 1 = 2: more could spill than drains, so the tube
    # is full under its gas; a Froude number of 0.71 does not carry that out, one of 1.4 does.
    slow, path = ENDS._replace(downstream_hydrostatic=10.5), replace(PATH, froude_velocity=froude_velocity)
    flow = flow_of(path, slow, primed=False)
    assert (flow.velocity, flow.separated) == (math.sqrt(0.5), False)
    assert flow.primed == primed
    assert flow_of(path, slow, primed=True).primed


@compiled
def conditions(path: Any, ends: tuple[float, float, float, float], primed: bool) -> tuple[Any, ...]:
    flows, margins = can_flow(path, ends, primed), crest_margins(path, ends)
    return (
        flows,
        holds_at_rest(path, ends, primed),
        driving_pressure(path, ends),
        margins[0],
        margins[1],
        cleared(path, ends[0]),
    )


@pytest.mark.parametrize("path", [LEVEL, PATH, TRAPPED, replace(TRAPPED, released=0.5, froude_velocity=4.0)])
def test_compiled_numbers_agree_with_arrays(path: TubePath) -> None:
    random = np.random.default_rng(1)
    rows = random.uniform([0.0, 0.0, 0.0, 0.0], [9.0, 2.0, 12.0, 12.0], size=(200, 4))
    rows[:50, 3] = np.maximum(rows[:50] @ [1, -1, 1, 0], 0.0)
    primed, ends = random.integers(2, size=200).astype(np.bool_), TubeEnds(*rows.T)
    plant = np.zeros(1, dtype=PLANT)
    for name in ("port_pressure", "column_pressure", "vapour_pressure", "trapped", "released", "crest"):
        plant[name] = getattr(path, name)
    plant["froude_velocity"] = path.froude_velocity
    at_once = np.broadcast_arrays(
        can_flow(path, ends, primed),
        holds_at_rest(path, ends, primed),
        driving_pressure(path, ends),
        *crest_margins(path, ends),
        cleared(path, ends.upstream_gas),
    )
    one_by_one = [conditions(plant[0], tuple(row), bool(wet)) for row, wet in zip(rows, primed, strict=True)]
    np.testing.assert_array_equal(np.array(at_once, dtype=np.float64).T, np.array(one_by_one))


def test_a_path_without_crest_is_always_primed() -> None:
    assert can_flow(LEVEL, ENDS, False)
    assert flow_of(LEVEL, ENDS, primed=False).primed


def test_hydrostatic_pressure_of_a_film_and_its_inverse(table_1_scene: Scene) -> None:
    outer = table_1_scene.disc.outer_radius
    pull = table_1_scene.liquid.density * table_1_scene.rotor.speed**2
    film = outer - 1e-9
    depth = outer - film
    pressure = column_pressure(scene=table_1_scene, radius=film)
    assert pressure == pytest.approx(pull * depth * (outer - depth / 2), rel=1e-14)
    whole = column_pressure(scene=table_1_scene, radius=0.03)
    assert whole == pytest.approx(pull * (outer**2 - 0.03**2) / 2, rel=1e-14)
    assert column_radius(scene=table_1_scene, pressure=whole) == pytest.approx(0.03, rel=1e-14)
    assert column_radius(scene=table_1_scene, pressure=10 * whole) == 0.0
