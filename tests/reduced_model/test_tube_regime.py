"""Pressures and regimes of the tube, by hand, for numbers and for arrays alike."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from ringbalance.physics.pressure.hydrostatics import column_radius, hydrostatic_pressure
from ringbalance.reduced_model.tube.regime import (
    ColumnFlow,
    SiphonCrest,
    Truth,
    TubeEnds,
    TubePath,
    can_flow,
    column_flow,
)

ENDS = TubeEnds(
    upstream_gas=5.0,
    downstream_gas=1.0,
    upstream_hydrostatic=7.0,
    downstream_hydrostatic=3.0,
    port_pressure=2.0,
)
CREST = SiphonCrest(column_pressure=9.0, vapour_pressure=-1.0, trapped=False)


def root(pressure: float, where: Truth) -> float:
    return math.sqrt(pressure) if where else 0.0


def flow_of(ends: TubeEnds[float], *, crest: SiphonCrest[float] | None, primed: bool) -> ColumnFlow[float]:
    return column_flow(ends=ends, crest=crest, primed=primed, siphon=root, separation=root)


def test_pressures_at_the_ends() -> None:
    assert ENDS.back_pressure() == 3.0
    assert ENDS.driving_pressure() == 5 - 1 + 7 - 3
    assert ENDS.stall_pressure() == 3 - 7
    assert ENDS.reversed().driving_pressure() == 1 - 5 + 3 - 7
    shallow = replace(ENDS, downstream_hydrostatic=1.5)
    assert (shallow.back_pressure(), shallow.downstream_open()) == (2.0, True)
    assert not replace(ENDS, upstream_hydrostatic=1.5).upstream_covered()


def test_pressures_at_the_crest() -> None:
    assert CREST.separation_margin(ENDS) == 5 + 1 + 7 - 9
    assert CREST.priming_pressure(ENDS) == 9 - 7
    assert replace(CREST, trapped=True).priming_pressure(ENDS) == 9 - 7 + (3 - 2)
    # With the downstream port open its gas fills the cavity, and trapped gas displaces nothing.
    shallow = replace(ENDS, downstream_hydrostatic=1.5)
    assert CREST.cavity_pressure(shallow) == 1.0
    assert replace(CREST, trapped=True).priming_pressure(shallow) == 9 - 7


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
    flow = flow_of(replace(ENDS, **changes), crest=CREST, primed=primed)
    assert (flow.velocity, flow.separated) == (pytest.approx(velocity), separated)


def test_a_column_at_exact_balance_stays() -> None:
    balanced = replace(ENDS, downstream_hydrostatic=11.0)
    flow = flow_of(balanced, crest=CREST, primed=True)
    assert (flow.velocity, flow.primed) == (0.0, True)
    assert not flow_of(balanced, crest=CREST, primed=False).primed


def test_a_separated_column_over_an_open_port_is_lost() -> None:
    shallow = replace(ENDS, downstream_hydrostatic=1.5)
    flow = flow_of(shallow, crest=CREST, primed=True)
    assert (flow.separated, flow.primed) == (True, False)


@pytest.mark.parametrize(
    ("froude_velocity", "primed"), [(0.0, True), (0.5, True), (1.0, False), (5.0, False)]
)
def test_a_started_tube_is_primed_once_its_flow_carries_the_gas_out(
    froude_velocity: float, primed: bool
) -> None:
    # Driving 5 - 1 + 7 - 10.5 = 0.5, gas margin 5 + 7 - 9 - 1 = 2: more could spill than drains, so the tube
    # is full under its gas; a Froude number of 0.71 does not carry that out, one of 1.4 does.
    slow, crest = replace(ENDS, downstream_hydrostatic=10.5), replace(CREST, froude_velocity=froude_velocity)
    flow = flow_of(slow, crest=crest, primed=False)
    assert (flow.velocity, flow.separated) == (math.sqrt(0.5), False)
    assert flow.primed is primed
    assert flow_of(slow, crest=crest, primed=True).primed


@pytest.mark.parametrize("crest", [None, CREST, replace(CREST, trapped=True)])
def test_arrays_agree_with_numbers(crest: SiphonCrest[float] | None) -> None:
    random = np.random.default_rng(1)
    columns = random.uniform([0.0, 0.0, 0.0, 0.0], [9.0, 2.0, 12.0, 12.0], size=(400, 4))
    primed = random.integers(2, size=400).astype(np.bool_)
    many = TubeEnds(
        upstream_gas=columns[:, 0],
        downstream_gas=columns[:, 1],
        upstream_hydrostatic=columns[:, 2],
        downstream_hydrostatic=columns[:, 3],
        port_pressure=2.0,
    )

    def roots(pressure: np.ndarray, where: Truth) -> np.ndarray:
        return np.where(where, np.sqrt(np.where(where, pressure, 0.0)), 0.0)

    at_once = column_flow(
        ends=many,
        crest=None
        if crest is None
        else SiphonCrest(**{f.name: getattr(crest, f.name) for f in fields(crest)}),
        primed=primed,
        siphon=roots,
        separation=roots,
    )
    for i, row in enumerate(columns.tolist()):
        one = flow_of(
            TubeEnds(
                upstream_gas=row[0],
                downstream_gas=row[1],
                upstream_hydrostatic=row[2],
                downstream_hydrostatic=row[3],
                port_pressure=2.0,
            ),
            crest=crest,
            primed=bool(primed[i]),
        )
        for field in fields(ColumnFlow):
            assert getattr(at_once, field.name)[i] == getattr(one, field.name)


def test_a_path_without_crest_is_always_primed() -> None:
    path = TubePath(
        density=1e3,
        port_pressure=2.0,
        hump_pressure=None,
        trapped=False,
        vapour_pressure=-1.0,
        released=0.0,
        froude_velocity=0.0,
    )
    assert path.crest is None
    assert can_flow(ends=ENDS, crest=path.crest, primed=False)
    assert replace(path, hump_pressure=9.0).crest is not None


def test_hydrostatic_pressure_of_a_film_and_its_inverse() -> None:
    film = 1e-9
    pressure = hydrostatic_pressure(density=1e3, angular_velocity=500.0, inner=0.1 - film, outer=0.1)
    depth = 0.1 - (0.1 - film)
    assert pressure == pytest.approx(1e3 * 500.0**2 * depth * (0.1 - depth / 2), rel=1e-14)
    whole = hydrostatic_pressure(density=1e3, angular_velocity=500.0, inner=0.06, outer=0.1)
    assert whole == pytest.approx(1e3 * 500.0**2 * (0.01 - 0.0036) / 2, rel=1e-14)
    radius = column_radius(density=1e3, angular_velocity=500.0, pressure=whole, outer=0.1)
    assert radius == pytest.approx(0.06, rel=1e-14)
    assert column_radius(density=1e3, angular_velocity=500.0, pressure=10 * whole, outer=0.1) == 0.0
