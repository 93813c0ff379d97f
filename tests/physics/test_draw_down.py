"""Depth of the liquid over a port at which gas enters it, against searches and integrations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, minimize_scalar

from ringbalance.physics.tube.draw_down import _draw_down_depth
from ringbalance.scene.arrays import FloatArray

PULL = 4.88e4
"""m/s^2, of the paper's disc."""
BORE = 1.5e-3


def _rate(froude: float) -> float:
    """Q of a tube whose velocity is that many times sqrt(g_c d)."""
    return froude * math.sqrt(PULL * BORE) * math.pi / 4 * BORE**2


def _depth(froude: float) -> float:
    return float(_draw_down_depth(flow_rate=_rate(froude), acceleration=PULL, bore=BORE))


@pytest.mark.parametrize("froude", [1.5, 4.0, 20.0])
def test_a_fast_flow_draws_gas_as_a_point_sink_does(froude: float) -> None:
    rate = _rate(froude)

    def head(y: float) -> float:
        return y + (rate / (2 * math.pi * y**2)) ** 2 / (2 * PULL)

    least = minimize_scalar(head, bounds=(1e-5, 1e-1), method="bounded", options={"xatol": 1e-12}).fun
    assert _depth(froude) == pytest.approx(least, rel=1e-7)


@pytest.mark.parametrize("froude", [0.05, 0.2, 0.4, 0.9])
def test_a_slow_flow_falls_over_the_rim_as_over_a_weir(froude: float) -> None:
    def most(h: float) -> float:
        """Largest flow over the rim from a layer of depth h at rest."""

        def lost(y: float) -> float:
            return -math.pi * BORE * y * math.sqrt(2 * PULL * (h - y))

        return float(-minimize_scalar(lost, bounds=(0.0, h), method="bounded", options={"xatol": 1e-12}).fun)

    depth = brentq(lambda h: most(h) - _rate(froude), 1e-7, 1e-1, xtol=1e-12)
    assert _depth(froude) == pytest.approx(depth, rel=1e-6)
    sink = 1.25 * (2 * math.pi**2) ** -0.2 * (_rate(froude) ** 2 / PULL) ** 0.2
    assert depth < sink


def test_the_two_laws_join_without_a_jump() -> None:
    froude = np.geomspace(0.1, 10.0, 2001)
    depth = np.array([_depth(float(f)) for f in froude])
    # The steeper law rises with the power 2/3: (10/0.1)^(1/2000) to that power is 0.154 % a step.
    assert np.all(np.diff(np.log(depth)) > 0)
    assert np.max(np.diff(np.log(depth))) < 0.00154


def test_a_viscous_layer_is_deeper_by_the_head_that_feeds_the_port() -> None:
    nu, rate, feed = 3.5e-4, 5e-6, 37e-3
    near = float(_draw_down_depth(flow_rate=rate, acceleration=PULL, bore=BORE))
    start = max(near, BORE / 2)

    def slope(s: float, y: FloatArray) -> FloatArray:
        """The whole layer sinks alike, so that what is beyond s flows through there."""
        return 3 * nu * rate * (1 - (s / feed) ** 2) / (2 * math.pi * s * PULL * y**3)

    layer = solve_ivp(slope, (start, feed), [near], rtol=1e-10, atol=1e-15, dense_output=True).sol
    inside, outside = near * start**2, quad(lambda s: float(layer(s)[0]) * 2 * s, start, feed)[0]
    depth = _draw_down_depth(
        flow_rate=rate, acceleration=PULL, bore=BORE, kinematic_viscosity=nu, feed_radius=feed
    )
    assert float(depth) / near > 1.3
    # The formula takes the mean of y^4 for that of y, which differ by little in a layer nearly flat.
    assert float(depth) == pytest.approx((inside + outside) / feed**2, rel=0.02)


def test_liquid_below_the_port_feeds_it_with_less_head() -> None:
    on_the_wall, above = (
        float(
            _draw_down_depth(
                flow_rate=5e-6,
                acceleration=PULL,
                bore=BORE,
                kinematic_viscosity=3.5e-4,
                feed_radius=37e-3,
                below=below,
            )
        )
        for below in (0.0, 5e-3)
    )
    inviscid = float(_draw_down_depth(flow_rate=5e-6, acceleration=PULL, bore=BORE))
    assert inviscid < above < inviscid + 0.02 * (on_the_wall - inviscid)
