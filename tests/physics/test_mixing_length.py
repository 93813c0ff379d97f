"""The mixing-length flow against roots of its own stress, and against measurements the formula is held to."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.verification.cases.friction import mixing_length, mixing_length_flow

Rows = Callable[[str], list[dict[str, float]]]


def by_roots(radius: float, grain: float) -> float:
    """f from bulk = int u' (R - y)^2 dy/R^2, with u' as a root of the stress, (1 + l^2 u') u' = tau."""

    def flux(y: float) -> float:
        squared = float(mixing_length(wall_distance=y, radius=radius, grain=grain)) ** 2
        tau = 1 - y / radius
        return float(brentq(lambda s: (1 + squared * s) * s - tau, 0.0, 1.0, xtol=1e-15)) * tau**2

    cuts = [*(y for y in (0.0, 3.0, 12.0, 60.0, 300.0) if y < radius), radius]
    bulk = sum(quad(flux, a, b, epsrel=1e-10)[0] for a, b in itertools.pairwise(cuts))
    return float(8 / bulk**2)


@pytest.mark.parametrize("reynolds", [3e3, 1e5, 1e7])
@pytest.mark.parametrize("roughness", [0.0, 2e-3, 3e-2])
def test_the_rule_agrees_with_adaptive_quadrature(reynolds: float, roughness: float) -> None:
    flow = mixing_length_flow(reynolds=reynolds, relative_roughness=roughness)
    radius = flow.friction_reynolds
    assert flow.friction_factor == pytest.approx(by_roots(radius, 2 * roughness * radius), rel=1e-7)
    assert radius == pytest.approx(reynolds * np.sqrt(flow.friction_factor / 32), rel=1e-9)


def test_a_flow_too_slow_for_turbulence_is_the_laminar_one() -> None:
    """The mixing length vanishes with R+, so that f = 64/Re."""
    assert mixing_length_flow(reynolds=1.0).friction_factor == pytest.approx(64.0, rel=1e-5)


def test_literature_smooth_measurements_and_the_formula(rows: Rows) -> None:
    """A few per cent above Re = 1e5, worse below, and 10 to 30 % near the transition: as is."""
    high = [row for row in rows("mckeon2004_oregon_smooth.csv") if row["Re"] > 6500][::4]
    for row in high:
        found = mixing_length_flow(reynolds=row["Re"]).friction_factor
        assert found == pytest.approx(row["f_darcy"], rel=0.06)
        formula = float(friction_factor(reynolds=row["Re"], relative_roughness=0))
        bar = float(friction_uncertainty(reynolds=row["Re"], relative_roughness=0))
        assert abs(found - formula) < bar
    low = mixing_length_flow(reynolds=3000.0).friction_factor
    assert 1.1 < low / float(friction_factor(reynolds=3000.0, relative_roughness=0)) < 1.3


def test_fully_rough_wall_has_its_logarithmic_law() -> None:
    """1/sqrt(f) = 2 log10(R/ks) + 1.74 of Nikuradse, less what the core's excess velocity takes off."""
    for ratio in (30.0, 300.0):
        flow = mixing_length_flow(reynolds=3e7, relative_roughness=0.5 / ratio)
        measured = 1 / (2 * np.log10(ratio) + 1.74) ** 2
        excess = np.sqrt(8 / flow.friction_factor) - np.sqrt(8 / measured)
        assert 0.3 < excess < 0.9
