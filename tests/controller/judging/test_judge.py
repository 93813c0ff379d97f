"""What is printed of drawn devices holds the truth as often as it says, on devices made up."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom, binomtest

from ringbalance.controller.balancer import Outcomes, settles_within
from ringbalance.controller.judging.judge import Judgement
from ringbalance.results.requirements import Proportion
from ringbalance.scene.arrays import FloatArray


@pytest.mark.parametrize("of", [64, 128])
def test_the_fraction_is_covered(of: int) -> None:
    """Wilson's bounds of every count, weighed by its chance: 95 % on average over true fractions."""
    ends = [Proportion(count=count, of=of) for count in range(of + 1)]
    true = np.linspace(0.5, 0.99, 99)
    chance = binom.pmf(np.arange(of + 1)[:, None], of, true)
    holds = np.array([(each.low <= true) & (true <= each.high) for each in ends])
    covered = (chance * holds).sum(axis=0)
    assert np.mean(covered) == pytest.approx(0.95, abs=0.01)
    assert covered.min() > 0.85


def judgement(times: FloatArray) -> Judgement:
    n = times.size
    outcomes = Outcomes(
        settling_time=times,
        final_amplitude=np.zeros(n),
        energy=np.zeros(n),
        usable_moment=np.ones(n),
        unbalance=np.ones(n),
        ended=("",) * n,
    )
    demands = (settles_within(math.inf, stated=False),)
    return Judgement(settings={}, required_fraction=0.9, demands=demands, outcomes=outcomes)


@pytest.mark.parametrize(("fraction", "never"), [(0.5, 0.0), (0.5, 0.2), (0.8, 0.05)])
def test_the_settling_times_bound_is_covered(fraction: float, never: float) -> None:
    """Exponential times of 128 devices, some of which never settle: one bound in 40 lies below the truth."""
    random = np.random.default_rng(7)
    truth = -math.log(1 - fraction / (1 - never))
    result = []
    for _ in range(400):
        times = np.where(random.random(128) < never, math.inf, random.exponential(size=128))
        printed = judgement(times).settling_time(fraction)
        result.append(printed is None or printed[1] >= truth)
    assert 0.95 < np.mean(result) < 0.999


@pytest.mark.parametrize("fraction", [0.5, 0.9])
def test_the_settling_time_of_a_fraction_is_that_of_the_last_device_in_it(fraction: float) -> None:
    """Of 64 devices that settle after 1 to 64 s: 58 s for nine tenths; the bound is by SciPy's Wilson."""
    times = np.random.default_rng(3).permutation(np.arange(1.0, 65.0))
    surely = [
        k for k in range(1, 65) if binomtest(k, 64).proportion_ci(0.95, method="wilson").low >= fraction
    ]
    assert judgement(times).settling_time(fraction) == ({0.5: 32.0, 0.9: 58.0}[fraction], float(surely[0]))
