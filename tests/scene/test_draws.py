"""Places of drawn inputs by number: a Latin hypercube a block, a column a name."""

from __future__ import annotations

import numpy as np

from ringbalance.scene.draws import BLOCK, deviates, quantiles


def test_every_block_takes_each_part_once() -> None:
    places = quantiles("bore", range(3 * BLOCK), seed=7)
    for block in range(3):
        parts = np.floor(BLOCK * places[block * BLOCK : (block + 1) * BLOCK]).astype(int)
        assert sorted(parts) == list(range(BLOCK))


def test_a_number_keeps_its_place() -> None:
    whole = quantiles("bore", range(200), seed=1)
    assert quantiles("bore", (130, 3), seed=1).tolist() == whole[[130, 3]].tolist()
    assert not np.any(quantiles("bore", range(200), seed=2) == whole)


def test_columns_do_not_go_together() -> None:
    one, other = (quantiles(name, range(64 * BLOCK), seed=0) for name in ("bore", "length"))
    # Of n = 4096 independent pairs the correlation has a standard deviation of 1/64.
    assert abs(np.corrcoef(one, other)[0, 1]) < 4 / 64


def test_deviates_are_standard_normal() -> None:
    z = deviates("speed", range(16 * BLOCK), seed=0)
    assert abs(np.mean(z)) < 0.005
    assert abs(np.std(z) - 1) < 0.02
