"""Noise that is a function of seed, member and sample: Philox4x32-10 and the normal numbers made of it.

Nothing is carried from one number to the next, so it does not matter who asks, in which order or in which
thread, and what nobody looks at costs nothing.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ringbalance.controller.compilation.compiled import compiled
from ringbalance.controller.ensemble.compiled_records import Record

Words = tuple[np.uint64, np.uint64, np.uint64, np.uint64]

ROUNDS: Final = 10
_FACTOR_0: Final = np.uint64(0xD2511F53)
_FACTOR_1: Final = np.uint64(0xCD9E8D57)
_STEP_0: Final = np.uint64(0x9E3779B9)
_STEP_1: Final = np.uint64(0xBB67AE85)
_LOW: Final = np.uint64(0xFFFFFFFF)
_WORD: Final = np.uint64(32)
_SHIFT: Final = np.uint64(21)
_DROP: Final = np.uint64(11)
_ONE: Final = np.uint64(1)
_UNIT: Final = 2.0**-53


def noise_key(*, seed: int) -> tuple[int, int]:
    """Two words of 32 bits, the key of an ensemble's noise."""
    first, second = np.random.SeedSequence(entropy=seed, spawn_key=(1,)).generate_state(2)
    return int(first), int(second)


@compiled
def philox(c0: np.uint64, c1: np.uint64, c2: np.uint64, c3: np.uint64, k0: np.uint64, k1: np.uint64) -> Words:
    """Four random words of 32 bits, kept in 64, of a counter and a key.

    Source: Salmon, Moraes, Dror and Shaw, "Parallel Random Numbers: As Easy as 1, 2, 3", SC'11.
    """
    for _ in range(ROUNDS):
        p0, p1 = _FACTOR_0 * c0, _FACTOR_1 * c2
        c0, c1, c2, c3 = (p1 >> _WORD) ^ c1 ^ k0, p1 & _LOW, (p0 >> _WORD) ^ c3 ^ k1, p0 & _LOW
        k0, k1 = (k0 + _STEP_0) & _LOW, (k1 + _STEP_1) & _LOW
    return c0, c1, c2, c3


@compiled
def _uniform_two(shared: Record, member: int, half: int, purpose: int) -> tuple[float, float]:
    """Both within (0, 1], with 53 bits."""
    who = np.uint64(member)
    a, b, c, d = philox(
        np.uint64(half), np.uint64(purpose), who & _LOW, who >> _WORD, shared.key_0, shared.key_1
    )
    return (((a << _SHIFT) ^ (b >> _DROP)) + _ONE) * _UNIT, (((c << _SHIFT) ^ (d >> _DROP)) + _ONE) * _UNIT


@compiled
def uniform_radii(shared: Record, member: int, half: int) -> tuple[float, float]:
    """Uniform numbers within (0, 1] for the sample 2 `half` and the next; a radius is sqrt(-2 ln) of each."""
    return _uniform_two(shared, member, half, 0)


@compiled
def noise_pair(shared: Record, member: int, sample: int) -> tuple[float, float]:
    """Two independent standard normal numbers for one sample (below 2^32) of one member (below 2^63).

    Source: Box and Muller, "A Note on the Generation of Random Normal Deviates" (1958).
    """
    radii, turns = uniform_radii(shared, member, sample // 2), _uniform_two(shared, member, sample // 2, 1)
    radius = math.sqrt(-2.0 * math.log(radii[sample & 1]))
    angle = 2.0 * math.pi * turns[sample & 1]
    return radius * math.cos(angle), radius * math.sin(angle)
