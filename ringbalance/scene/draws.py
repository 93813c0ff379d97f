"""Drawn devices by number: quantile of each uncertain input of a device in the input's distribution.

A block of 64 devices is a Latin hypercube: every input has one value in each 64th of its distribution.  The
column of an input depends only on the seed, the block and the input's name, so that a device keeps its inputs
in every setting, remedy, command and process, and with any number of further inputs.
Source: McKay, Beckman and Conover, "A Comparison of Three Methods for Selecting Values of Input Variables in
    the Analysis of Output from a Computer Code", Technometrics 21 (1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final
from zlib import crc32

import numpy as np
from scipy.special import ndtri

from ringbalance.scene.arrays import FloatArray

BLOCK: Final = 64
"""Devices of one Latin hypercube."""
_KEPT_COLUMNS: Final = 4096
_LEAST_QUANTILE: Final = 1e-12
"""Smallest distance of a quantile from 0 and from 1."""
_NOISE_KEY: Final = 3
"""Last number of the key of a run's noise, which no key of a drawn input has."""


def quantiles(name: str, numbers: Sequence[int], *, seed: int) -> FloatArray:
    """Quantile of an input in its distribution, in (0, 1), for devices by number."""
    devices = np.asarray(numbers, dtype=np.int64)
    block, row = np.divmod(devices, BLOCK)
    values = np.empty(devices.size)
    for each in np.unique(block):
        in_block = block == each
        values[in_block] = _column(name, int(each), seed)[row[in_block]]
    return np.clip(values, _LEAST_QUANTILE, 1.0 - _LEAST_QUANTILE)


def deviates(name: str, numbers: Sequence[int], *, seed: int) -> FloatArray:
    """Standard normal deviates of an input, for devices by number."""
    return np.asarray(ndtri(quantiles(name, numbers, seed=seed)))


def run_noise(seed: int, number: int) -> np.random.Generator:
    """Random generator of the sensor noise in the run of a drawn device."""
    key = np.random.SeedSequence(entropy=seed, spawn_key=(number, _NOISE_KEY))
    return np.random.Generator(np.random.PCG64(key))


@lru_cache(32)
def noise_table(seed: int, numbers: tuple[int, ...], samples: int, *, devices: bool = True) -> FloatArray:
    """First standard normal numbers of the sensor noise in runs, shape (devices, samples, 2); read only.

    Args: `devices`: True for drawn devices; False for single runs of the scene itself, each with the seed
        `seed` plus its number.
    """
    table = np.empty((len(numbers), samples, 2))
    for number, row in zip(numbers, table, strict=True):
        random = run_noise(seed, number) if devices else np.random.default_rng(seed + number)
        random.standard_normal(out=row)
    return table


@lru_cache(_KEPT_COLUMNS)
def _column(name: str, block: int, seed: int) -> FloatArray:
    key = np.random.SeedSequence(entropy=seed, spawn_key=(block, crc32(name.encode())))
    random = np.random.Generator(np.random.PCG64(key))
    return np.asarray((random.permutation(BLOCK) + random.random(BLOCK)) / BLOCK)
