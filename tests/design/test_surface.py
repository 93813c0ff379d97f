"""The surface through counts: of made-up devices whose fractions are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import expit, logit

from ringbalance.design.surface import Surface
from ringbalance.scene.arrays import FloatArray

BLOCKS = 8
DEVICES = 64


def true_logits(places: FloatArray) -> FloatArray:
    """Two that matter, one of which has an optimum within, and one that does not."""
    return np.asarray(1.0 + 4.0 * places[:, 0] - 12.0 * (places[:, 1] - 0.4) ** 2)


@pytest.fixture(scope="module")
def known() -> tuple[FloatArray, Surface]:
    random = np.random.default_rng(1)
    places, blocks = random.random((120, 3)), np.arange(120) % BLOCKS
    lucky = np.linspace(-0.5, 0.5, BLOCKS)[blocks]
    met = random.binomial(DEVICES, expit(true_logits(places) + lucky))
    devices = np.full(120, DEVICES)
    surface = Surface.of(places, met=met, devices=devices, blocks=blocks, weights=np.ones(120))
    return random.random((400, 3)), surface


def test_many_designs_say_more_than_each(known: tuple[FloatArray, Surface]) -> None:
    """One design alone: 3 % at nine tenths."""
    places, surface = known
    logits, spread = surface.logits(places)
    error = expit(logits) - expit(true_logits(places))
    assert np.sqrt(np.mean(error**2)) < 0.015
    assert 0.8 < np.mean(np.abs(logits - true_logits(places)) < 2 * spread) <= 1.0


def test_the_optimum_is_found_where_it_lies(known: tuple[FloatArray, Surface]) -> None:
    _, surface = known
    line = np.column_stack([np.full(101, 0.5), np.linspace(0, 1, 101), np.full(101, 0.5)])
    assert line[np.argmax(surface.logits(line)[0]), 1] == pytest.approx(0.4, abs=0.05)


def test_designs_far_away_do_not_bend_it() -> None:
    """All of them fail, at places that look alike; their weights are small."""
    random = np.random.default_rng(2)
    places = random.random((80, 1))
    near = np.arange(80) < 60
    met = np.where(near, random.binomial(DEVICES, 0.9, 80), 0)
    fits = [
        Surface.of(
            places,
            met=met,
            devices=np.full(80, DEVICES),
            blocks=np.zeros(80, dtype=np.intp),
            weights=np.where(near, 1.0, weight),
        ).logits(np.array([[0.5]]))[0][0]
        for weight in (1e-6, 1.0)
    ]
    assert fits[0] == pytest.approx(logit(0.9), abs=0.25)
    assert fits[1] < fits[0] - 1.0
