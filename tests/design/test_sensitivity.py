"""Indices against functions whose shares of variance are known, and against SALib where it is installed."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import ringbalance as rb
from ringbalance.design.sensitivity import first_order, total_order
from ringbalance.design.sobol import sobol
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

A, B = 7.0, 0.1


def ishigami(x: FloatArray) -> FloatArray:
    """Function of x over (-pi, pi): Ishigami and Homma (1990)."""
    y = np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])
    return np.asarray(y)


def test_indices_of_ishigami_lie_in_their_intervals() -> None:
    x = math.pi * (2 * sobol(3, 4096) - 1)
    alone = np.array([(1 + B * math.pi**4 / 5) ** 2 / 2, A**2 / 8, 0.0])
    together = B**2 * math.pi**8 * (1 / 18 - 1 / 50)
    variance = np.sum(alone) + together
    shares, widths = first_order(x, ishigami(x))
    assert np.all(np.abs(shares - alone / variance) < widths)
    assert np.all(widths < 0.06)
    for rows, narrow in ((256, 0.3), (1024, 0.003)):
        shares, widths = total_order(x[:rows], ishigami(x[:rows]))
        exact = (alone + together * np.array([1, 0, 1])) / variance
        assert np.all(np.abs(shares - exact) < widths)
        assert np.all(widths < narrow)


@pytest.mark.filterwarnings("ignore")
def test_total_indices_are_those_of_salib() -> None:
    """From a design of its own, made for them."""
    sample = pytest.importorskip("SALib.sample.sobol").sample
    analyze = pytest.importorskip("SALib.analyze.sobol").analyze
    problem = {"num_vars": 3, "names": ["a", "b", "c"], "bounds": [[-math.pi, math.pi]] * 3}
    theirs = sample(problem, 1024, calc_second_order=False, seed=1)
    indices = analyze(problem, ishigami(theirs), calc_second_order=False, seed=1)
    x = math.pi * (2 * sobol(3, 1024) - 1)
    shares, widths = total_order(x, ishigami(x))
    assert np.all(np.abs(shares - indices["ST"]) < widths + indices["ST_conf"])


def test_the_interval_of_a_negative_share_holds_zero() -> None:
    """Evenly spread points lack the noise that the estimate subtracts."""
    negative = 0
    for rows in (64, 256, 1024):
        for seed in range(5):
            x = sobol(3, rows, seed=seed)
            shares, widths = first_order(x, x[:, 0] + 0.3 * x[:, 1] ** 2)
            negative += int(np.count_nonzero(shares < 0))
            assert np.all(shares + widths >= 0)
    assert negative >= 15


_Steep = tuple[float, float, float]
"""Exponent, distance of a pole from the range, and place of a jump, of the three factors of a product."""


def steep_product(x: FloatArray, steep: _Steep) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Product of exp(a x1), 1/(x2 + e) and a jump of 1 + [x3 > c], with its first-order and total indices.

    Of a product of independent factors, V_i = E f_i^2 / (E f_i)^2 - 1 and V = prod(1 + V_i) - 1: the indices
    are V_i/V and V_i prod_(j != i)(1 + V_j)/V.
    """
    a, e, c = steep
    y = np.exp(a * x[:, 0]) / (x[:, 1] + e) * (1 + (x[:, 2] > c))
    squares = np.array([math.expm1(2 * a) / (2 * a), 1 / e - 1 / (1 + e), 4 - 3 * c])
    means = np.array([math.expm1(a) / a, math.log1p(1 / e), 2 - c])
    parts = squares / means**2 - 1
    variance = np.prod(1 + parts) - 1
    return y, parts / variance, parts * np.prod(1 + parts) / (1 + parts) / variance


@pytest.mark.parametrize("steep", [(0.5, 0.05, 0.6), (5.0, 1.0, 0.9), (0.2, 2.0, 0.5), (1.0, 0.03, 0.1)])
@pytest.mark.parametrize("indices", [first_order, total_order])
def test_intervals_of_a_steep_result_hold_its_shares(
    indices: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]], steep: _Steep
) -> None:
    """Of 40 samples, Sobol's and Latin ones, at least 36 intervals, and they are narrow."""
    held, half_widths = np.zeros(3), np.zeros(3)
    for seed in range(40):
        random = np.random.default_rng(seed)
        latin = np.stack([(random.permutation(512) + random.random(512)) / 512 for _ in range(3)], axis=1)
        x = sobol(3, 512, seed=seed) if seed % 2 else latin
        y, first, total = steep_product(x, steep)
        shares, widths = indices(x, y)
        held += np.abs(shares - (first if indices is first_order else total)) <= widths
        half_widths += widths / 40
    assert np.all(held >= 36)
    assert np.all(half_widths < 0.25)


@pytest.mark.parametrize("rows", [64, 512, 4096])
def test_nothing_is_said_near_a_pole_where_a_few_rows_carry_the_variance(rows: int) -> None:
    """The variance of 1/x is infinite: in nearly all samples of any size."""
    told = 0
    for seed in range(20):
        x = sobol(2, rows, seed=seed)
        y = (1 + x[:, 1]) / x[:, 0]
        told += int(np.isfinite(first_order(x, y)[0]).any())
        assert np.isnan(total_order(x, y)[0]).all() == np.isnan(first_order(x, y)[0]).all()
    assert told <= 1


def test_intervals_hold_what_they_promise() -> None:
    """In 100 samples of x1 + x2/2, some 95 intervals hold 0.8 and 0.2."""
    random, held = np.random.default_rng(5), np.zeros(2)
    for _ in range(100):
        x = random.random((256, 2))
        shares, widths = first_order(x, x[:, 0] + x[:, 1] / 2)
        held += np.abs(shares - [0.8, 0.2]) < widths
    assert np.all(held >= 85)


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_total_intervals_hold_what_they_promise(noise: float) -> None:
    """In 40 Latin samples of a sum with a product in it, and a noise that may belong to either input."""
    random, held = np.random.default_rng(5), np.zeros(2)
    both = 4 / 144
    variance = 1 / 12 + 1 / 48 + both + noise**2
    exact = (np.array([1 / 12, 1 / 48]) + both + noise**2 / 2) / variance
    for _ in range(40):
        x = np.stack([(random.permutation(256) + random.random(256)) / 256 for _ in range(2)], axis=1)
        y = x[:, 0] + x[:, 1] / 2 + 2 * (x[:, 0] - 0.5) * (x[:, 1] - 0.5)
        shares, widths = total_order(x, y + noise * random.standard_normal(256))
        held += np.abs(shares - exact) < widths
    assert np.all(held >= 37)
    assert np.all(widths < 0.12)


def test_nothing_is_said_of_few_rows_or_of_a_constant() -> None:
    x = np.random.default_rng(0).random((63, 2))
    for indices in (first_order, total_order):
        assert np.isnan(indices(x, x[:, 0])[0]).all()
        assert np.isnan(indices(np.tile(x, (2, 1)), np.ones(126))[0]).all()


def test_a_sample_tells_what_moves_its_results(paper_scene: Scene) -> None:
    vary = {"tube.bore": "0.7mm:2mm", "gas.pressure": "0.6MPa:1MPa"}
    table = rb.sweep(paper_scene, vary, sample="sobol:128", intervals=False)
    first, total = table.sensitivity(), table.sensitivity(total=True)
    assert "lambda" not in first
    share, width = first["drag_coefficient"]["tube.bore"]
    assert share - width > first["drag_coefficient"]["gas.pressure"][0]
    for path, (share_total, half) in total["drag_coefficient"].items():
        share, width = first["drag_coefficient"][path]
        assert share_total + half > share - width
    with pytest.raises(KeyError):
        rb.sweep(paper_scene, {"tube.bore": "0.7mm:2mm:3"}).sensitivity()["velocity"]


def test_half_of_what_nothing_explains_counts_for_every_input() -> None:
    """A result that is noise alone: each input may take part in all of it or in none, so a half +- a half."""
    random = np.random.default_rng(11)
    x = np.stack([(random.permutation(1024) + random.random(1024)) / 1024 for _ in range(2)], axis=1)
    shares, widths = total_order(x, random.standard_normal(1024))
    assert shares == pytest.approx([0.5, 0.5], abs=0.05)
    assert widths == pytest.approx([0.5, 0.5], abs=0.1)
