"""Indices against Ishigami's function, whose shares of variance are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.design.sensitivity import first_order
from ringbalance.design.sobol import sobol
from ringbalance.scene.models import Scene

A, B = 7.0, 0.1


def test_indices_of_ishigami_lie_in_their_intervals() -> None:
    """sin x1 + a sin^2 x2 + b x3^4 sin x1 over (-pi, pi): Ishigami and Homma (1990)."""
    x = math.pi * (2 * sobol(3, 4096) - 1)
    y = np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])
    whole = A**2 / 8 + B * math.pi**4 / 5 + B**2 * math.pi**8 / 18 + 0.5
    exact = np.array([(1 + B * math.pi**4 / 5) ** 2 / 2, A**2 / 8, 0.0]) / whole
    shares, widths = first_order(x, y)
    assert np.all(np.abs(shares - exact) < widths)
    assert np.all(widths < 0.06)


def test_intervals_hold_what_they_promise() -> None:
    """Of 100 samples of x1 + x2/2, some 95 intervals hold 0.8 and 0.2."""
    random, held = np.random.default_rng(5), np.zeros(2)
    for _ in range(100):
        x = random.random((256, 2))
        shares, widths = first_order(x, x[:, 0] + x[:, 1] / 2)
        held += np.abs(shares - [0.8, 0.2]) < widths
    assert np.all(held >= 85)


def test_nothing_is_said_of_few_rows_or_of_a_constant() -> None:
    x = np.random.default_rng(0).random((63, 2))
    assert np.isnan(first_order(x, x[:, 0])[0]).all()
    assert np.isnan(first_order(np.tile(x, (2, 1)), np.ones(126))[0]).all()


def test_a_sample_tells_what_moves_its_results(paper_scene: Scene) -> None:
    vary = {"tube.bore": "0.7mm:2mm", "gas.pressure": "0.6MPa:1MPa"}
    found = rb.sweep(paper_scene, vary, sample="sobol:128", intervals=False).sensitivity()
    assert "lambda" not in found
    share, width = found["drag_coefficient"]["tube.bore"]
    assert share - width > found["drag_coefficient"]["gas.pressure"][0]
    with pytest.raises(KeyError):
        rb.sweep(paper_scene, {"tube.bore": "0.7mm:2mm:3"}).sensitivity()["velocity"]
