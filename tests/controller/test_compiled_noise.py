"""The ensembles' noise: the published numbers of its generator, and what normal numbers must show."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from scipy import stats

from ringbalance.controller.ensemble.compiled_noise import noise_key, noise_pair, philox
from ringbalance.controller.ensemble.compiled_records import SHARED


def words(*values: int) -> tuple[np.uint64, ...]:
    return tuple(np.uint64(value) for value in values)


ONES = 0xFFFFFFFF


@pytest.mark.parametrize(
    ("counter", "key", "known"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((ONES,) * 4, (ONES,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
        ),
    ],
)
def test_the_generator_gives_its_published_numbers(
    counter: tuple[int, ...], key: tuple[int, ...], known: tuple[int, ...]
) -> None:
    # The known answers of Random123 1.14 for philox4x32, 10 rounds.
    c0, c1, c2, c3 = words(*counter)
    assert philox(c0, c1, c2, c3, *words(*key)) == known
    plain = cast(Any, philox).py_func
    assert plain(c0, c1, c2, c3, *words(*key)) == known


@pytest.fixture(scope="module")
def drawn() -> np.ndarray[Any, np.dtype[np.float64]]:
    """Amplitude and phase noise, shape (members, samples, 2)."""
    shared = np.zeros(1, dtype=SHARED)
    shared["key_0"], shared["key_1"] = noise_key(seed=5)
    return np.array([[noise_pair(shared[0], m, s) for s in range(60)] for m in range(150)])


def test_the_noise_is_standard_normal(drawn: np.ndarray[Any, np.dtype[np.float64]]) -> None:
    for which in range(2):
        assert stats.kstest(drawn[..., which].ravel(), "norm").pvalue > 0.01


def test_the_noise_of_neighbours_is_independent(drawn: np.ndarray[Any, np.dtype[np.float64]]) -> None:
    a, p = drawn[..., 0], drawn[..., 1]
    pairs = ((a, p), (a[:, :-1], a[:, 1:]), (p[:, :-1], p[:, 1:]), (a[:-1], a[1:]), (a[:, :-1], p[:, 1:]))
    for one, other in pairs:
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 4 / np.sqrt(one.size)
        squares = np.corrcoef(one.ravel() ** 2, other.ravel() ** 2)[0, 1]
        assert abs(squares) < 4 / np.sqrt(one.size)


def member_noise(*, seed: int, member: int, sample: int) -> tuple[float, float]:
    """Noise of amplitude and phase in one sample of one member, in standard deviations."""
    shared = np.zeros(1, dtype=SHARED)
    shared["key_0"], shared["key_1"] = noise_key(seed=seed)
    return noise_pair(shared[0], member, sample)


def test_seed_member_and_sample_all_count() -> None:
    found = {
        member_noise(seed=seed, member=member, sample=sample)
        for seed in (0, 1, 2**70)
        for member in (0, 1, 2**32, 2**32 + 1)
        for sample in (0, 1, 2, 77)
    }
    assert len(found) == 3 * 4 * 4
