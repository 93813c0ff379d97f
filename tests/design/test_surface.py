"""The surface through counts: of made-up devices whose fractions are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import check_grad
from scipy.special import expit

from ringbalance.design import surface as under_test
from ringbalance.design.surface import Surface
from ringbalance.scene.arrays import FloatArray, IntArray

DEVICES = 64


def true_logits(places: FloatArray) -> FloatArray:
    """Two that matter, one of which has an optimum within, and one that does not."""
    return np.asarray(1.0 + 4.0 * places[:, 0] - 12.0 * (places[:, 1] - 0.4) ** 2)


def counted(fraction: FloatArray, *, seed: int) -> IntArray:
    """Counts of a block each, whose inputs are spread evenly: half the variance of independent devices."""
    spread = np.sqrt(0.5 * DEVICES * fraction * (1 - fraction))
    count = DEVICES * fraction + spread * np.random.default_rng(seed).standard_normal(fraction.size)
    return np.clip(np.rint(count), 0, DEVICES).astype(np.intp)


@pytest.fixture(scope="module")
def raced() -> tuple[FloatArray, Surface]:
    random = np.random.default_rng(1)
    places = random.random((160, 3))
    met = counted(expit(true_logits(places)), seed=2)
    return random.random((400, 3)), Surface.of(places, met=met, devices=np.full(160, DEVICES))


def test_many_designs_say_more_than_each(raced: tuple[FloatArray, Surface]) -> None:
    """One design alone: 3 % at nine tenths."""
    places, surface = raced
    logits, spread = surface.logits(places)
    error = expit(logits) - expit(true_logits(places))
    assert np.sqrt(np.mean(error**2)) < 0.015
    assert 0.8 < np.mean(np.abs(logits - true_logits(places)) < 2 * spread) <= 1.0


def test_the_optimum_is_found_where_it_lies(raced: tuple[FloatArray, Surface]) -> None:
    _, surface = raced
    line = np.column_stack([np.full(101, 0.5), np.linspace(0, 1, 101), np.full(101, 0.5)])
    assert line[np.argmax(surface.logits(line)[0]), 1] == pytest.approx(0.4, abs=0.05)


def test_what_does_not_matter_is_recognised(raced: tuple[FloatArray, Surface]) -> None:
    _, surface = raced
    assert surface.lengths[2] > 3 * min(surface.lengths[:2])


def test_a_cliff_does_not_hide_what_matters_on_the_plain_behind_it() -> None:
    """Devices that cannot be balanced below a size; a loop that loses fewer of the others at an optimum."""

    def true(places: FloatArray) -> FloatArray:
        loop = expit(3.0 - 20.0 * (places[:, 1] - 0.6) ** 2)
        return np.asarray(expit(40.0 * (places[:, 0] - 0.4)) * loop)

    places = np.random.default_rng(3).random((150, 2))
    surface = Surface.of(places, met=counted(true(places), seed=4), devices=np.full(150, DEVICES))
    line = np.column_stack([np.full(101, 0.7), np.linspace(0, 1, 101)])
    assert line[np.argmax(surface.logits(line)[0]), 1] == pytest.approx(0.6, abs=0.07)
    cliff = np.column_stack([np.linspace(0.3, 0.8, 101), np.full(101, 0.6)])
    assert np.max(np.abs(expit(surface.logits(cliff)[0]) - true(cliff))) < 0.08


def test_a_design_of_many_devices_is_known_better(raced: tuple[FloatArray, Surface]) -> None:
    places, _ = raced
    some, met = places[:2], np.array([58, 928])
    surface = Surface.of(some, met=met, devices=np.array([DEVICES, 16 * DEVICES]))
    _, spread = surface.logits(some)
    assert spread[1] < 0.5 * spread[0]


def test_the_gradient_by_which_lengths_are_found_is_right() -> None:
    random = np.random.default_rng(5)
    places, start = random.random((20, 3)), np.log([2.0, 0.5, 0.5, 0.5])
    arguments = {
        "start": start,
        "apart": (places[:, np.newaxis] - places) ** 2,
        "seen": random.standard_normal(20),
        "noise": np.full(20, 0.1),
    }
    at = start + 0.3 * random.standard_normal(4)
    difference = check_grad(
        lambda x: under_test._loss(x, **arguments)[0], lambda x: under_test._loss(x, **arguments)[1], at
    )
    assert difference < 1e-5
