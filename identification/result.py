"""What a fit finds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from ringbalance.identification.identifiability import Combination, Identified
from ringbalance.identification.intervals import Profile
from ringbalance.identification.optimisation import Optimum
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.origins import Origin
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES

LAMBDA_FAR: Final = 2**0.25
"""Factor on lambda, or its inverse, from which it is doubted: halfway, in logarithms, from 1 to the square
root of two that rms amplitudes are wrong by where zero to peak is stated."""


@dataclass(frozen=True, kw_only=True)
class FittedParameter:
    """One parameter before and after; SI, intervals of 95 %."""

    name: str
    value: float
    interval: tuple[float, float]
    at_bound: tuple[bool, bool]
    """Whether an end of the interval is a rule of the scene and not the data."""
    before: float
    """Of the scene."""
    before_interval: tuple[float, float] | None
    """By the scene's [uncertainty]; None where nothing is known beforehand."""
    verdict: Identified
    text: str
    """The verdict with its reason, in one sentence."""
    profile: Profile
    curve: tuple[tuple[float, float], ...] = ()
    """Values, SI, and the rise of minus two log likelihood there, over that at the ends of the interval."""

    @property
    def half_width(self) -> float | None:
        """The larger distance from the value to an end of its interval; None: it has no end."""
        width = max(self.interval[1] - self.value, self.value - self.interval[0])
        return width if math.isfinite(width) else None

    @property
    def origin(self) -> Origin:
        """Of the value in a saved scene."""
        return "measured" if self.verdict is Identified.IDENTIFIED else "inferred"

    @property
    def contradicts(self) -> bool:
        """Whether the value lies outside what was known before: [uncertainty] or the data are wrong."""
        low, high = self.before_interval or (-math.inf, math.inf)
        return not low <= self.value <= high

    @property
    def doubts(self) -> tuple[str, ...]:
        """What speaks against the value, each in one sentence."""
        found = []
        if self.contradicts:
            found.append(
                "the fitted value lies outside what the scene's [uncertainty] states; one of the two is wrong"
            )
        if self.name == "lambda_factor" and not 1 / LAMBDA_FAR < self.value < LAMBDA_FAR:
            found.append(
                "lambda follows from the geometry within a few percent, and a value so far from 1 mostly has "
                "another cause: how amplitudes are counted, a unit, the influence coefficient, or the law"
            )
        return tuple(found)

    @property
    def path(self) -> str:
        """Place in the scene, such as "tube.bore"."""
        return path_of(self.name)


def path_of(name: str) -> str:
    """Place in the scene of what fits name "bore"; of eccentric masses the name is one."""
    table = UNCERTAIN_QUANTITIES.get(name)
    return name if table is None else f"{table}.{name}"


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Noise of one column of one kind of data."""

    group: str
    """Kind and column."""
    standard_deviation: float | None
    """SI; None where the data give it row by row."""
    estimated: bool
    freedom: float | None
    """Degrees of freedom behind an estimate."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Joint:
    """Normal distribution of fitted parameters and held inputs."""

    names: tuple[str, ...]
    """Of the parameters, then of the held inputs, as the fit names them."""
    values: FloatArray
    """SI; of an error of a model in its standard deviations."""
    covariance: FloatArray
    """Of these, shape (n, n)."""

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations."""
        return np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, kw_only=True, eq=False)
class FileResiduals:
    """Residuals of one file over their standard deviation, one row a row of the file."""

    file: str
    kind: str
    lines: IntArray
    """Shape (n,)."""
    normalised: FloatArray
    """Measured less fitted; shape (n, 1), or (n, 2) of a vibration: real and imaginary part."""
    down_weighted: BoolArray
    """Rows that a robust loss counts less than half, shape (n,)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FitResult:
    """A fit of a scene's parameters to files of measurements."""

    parameters: tuple[FittedParameter, ...]
    correlations: FloatArray
    """Of the parameters in their own scales, in that order."""
    combinations: tuple[Combination, ...]
    """Products of powers of parameters that are not identified by themselves."""
    noise: tuple[Noise, ...]
    residuals: tuple[FileResiduals, ...]
    held: Mapping[str, float]
    """Uncertain inputs of the scene that were not fitted, with their standard deviations, SI; their effect is
    in all intervals."""
    pulls: Mapping[str, float]
    """The likeliest error of each of them, over its expanded uncertainty (95 %)."""
    loss: str
    starts: int
    evaluations: int
    """Predictions of all data."""
    log_likelihood: float
    """Of the data at the optimum, priors and held inputs with it, but for constants."""
    scene: Any
    """With the fitted values, the values to which held inputs are pulled, and corrected models."""
    joint: Joint
    """Parameters and held inputs together."""
    optimum: Optimum
    """For criticism and for the choice of the next measurement."""

    @property
    def pulled(self) -> tuple[str, ...]:
        """Held inputs that the data pull out of what is stated of them, each in one sentence."""
        return tuple(
            f"the data pull {name} off by {abs(pull):.2g} of its stated uncertainties (95 %), and it was not "
            "fitted: fit it, or look at what is stated of it"
            for name, pull in self.pulls.items()
            if abs(pull) > 1
        )

    def parameter(self, name: str) -> FittedParameter:
        """One parameter by name. Raises: KeyError: it was not fitted."""
        for each in self.parameters:
            if each.name == name:
                return each
        raise KeyError(name)
