"""Fit of a scene to measurements: maximum likelihood, profiles, verdicts, and the result."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np

from ringbalance.identification.identifiability import Combination, Identified, combinations, verdicts
from ringbalance.identification.intervals import (
    Joint,
    Profile,
    about_pulls,
    covariance,
    joint_of,
    profiles,
    scene_as_fitted,
)
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.likelihood import DataBlock, Problem
from ringbalance.identification.optimisation import Optimum, optimum_as_stated
from ringbalance.identification.parameters import FitError, Parameter, inputs_of, path_of
from ringbalance.identification.reading import KINDS, kinds_of
from ringbalance.identification.reading_likelihood import passive
from ringbalance.results.rows import Finding, text_of
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.origins import Origin
from ringbalance.scene.uncertain import NORMAL_95

_LAMBDA_FAR: Final = 2**0.25
"""Factor on lambda, or its inverse, from which on it is doubted: geometric mean of 1 and the square root of
two, the error of rms amplitudes stated as zero to peak."""


_MAX_PULL_SIGMAS: Final = 3.0
"""Standard deviations by which the data may disagree with the prior."""
_MOVABLE_FRACTION: Final = 0.1
"""Smallest standard deviation of a value's shift by data that can disagree, over that of the prior."""
_LITTLE: Final = 1e-4
"""Change of a quantity in a test for its effect: relative, or in SI units if it is zero."""
Source = Literal["[uncertainty]", "geometry"]
_INTERVAL_FROM: Final[Mapping[Source | None, str]] = {
    "[uncertainty]": "interval_stated",
    "geometry": "interval_of_geometry",
    None: "interval_unknown",
}
"""Code of the sentence on the source of the interval before the fit."""


@dataclass(frozen=True, kw_only=True)
class FittedParameter:
    """One parameter before and after the fit; SI, intervals of 95 %."""

    name: str
    value: float
    interval: tuple[float, float]
    at_bound: tuple[bool, bool]
    """True for each end of the interval that is a bound of the scene and not set by the data."""
    before: float
    """Value of the scene."""
    before_interval: tuple[float, float] | None
    """Prior interval (95 %), SI; None without prior knowledge."""
    before_source: Source | None
    """Source of that interval."""
    verdict: Identified
    text: str
    """Verdict with its reason, in one sentence."""
    profile: Profile
    curve: tuple[tuple[float, float], ...] = ()
    """Values, SI, and the rise of -2 ln L there, over the rise at the ends of the interval."""

    @property
    def half_width(self) -> float | None:
        """Larger distance from the value to an end of its interval, SI; None: an end is infinite."""
        width = max(self.interval[1] - self.value, self.value - self.interval[0])
        return width if math.isfinite(width) else None

    @property
    def origin(self) -> Origin:
        """Origin of the value in a saved scene."""
        sound = self.verdict is Identified.IDENTIFIED and not self._impossible
        return "measured" if sound else "inferred"

    @property
    def contradicts(self) -> bool:
        """True if the value lies outside the prior interval: either that interval or the data are wrong."""
        low, high = self.before_interval or (-math.inf, math.inf)
        return not low <= self.value <= high

    @property
    def _impossible(self) -> bool:
        """True for a lag that no passive rotor has, unless that of the scene is of this kind too."""
        is_lag = self.path.rpartition(".")[2] == "lag_angle" and passive(self.before)
        return is_lag and not any(map(passive, (self.value, *self.interval)))

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons to doubt the value, one sentence each."""
        disagrees, doubts = self.contradicts, []
        if self.before_interval is not None:
            # If the data agree with the prior of standard deviation p, and q remains after the fit, the shift
            # of the value has the standard deviation (p^2 - q^2)^(1/2).
            prior = (self.before_interval[1] - self.before) / NORMAL_95
            left = (self.interval[1] - self.interval[0]) / (2 * self.profile.factor)
            moved = math.sqrt(max(prior**2 - left**2, 0.0))
            disagrees |= (
                moved > _MOVABLE_FRACTION * prior and abs(self.value - self.before) > _MAX_PULL_SIGMAS * moved
            )
        if self.before_source == "[uncertainty]" and disagrees:
            doubts.append(text_of("outside_stated" if self.contradicts else "data_outside_stated"))
        far = self.name == "lambda_factor" and not 1 / _LAMBDA_FAR < self.value < _LAMBDA_FAR
        if far or (self.before_source == "geometry" and disagrees):
            doubts.append(text_of("outside_geometry"))
        if self._impossible:
            doubts.append(text_of("lag_impossible"))
        return tuple(doubts)

    @property
    def path(self) -> str:
        """Path in the scene, such as "tube.bore"."""
        return path_of(self.name)


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Noise of one column of one kind of data."""

    group: str
    """Kind and column."""
    standard_deviation: float | None
    """Standard deviation, SI; None if the data state it row by row."""
    estimated: bool
    degrees_of_freedom: float | None
    """Degrees of freedom of an estimated noise."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _FileResiduals:
    """Normalised residuals of one file, one row for each row of the file."""

    file: str
    kind: str
    lines: IntArray
    """Line of each row in the file, shape (n,)."""
    normalised: FloatArray
    """(measured - fitted)/sigma, shape (n, 1); for a vibration (n, 2), real and imaginary part."""
    down_weighted: BoolArray
    """True for rows with a weight below one half in a robust loss, shape (n,)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FitResult:
    """A fit of a scene's parameters to files of measurements."""

    parameters: tuple[FittedParameter, ...]
    correlations: FloatArray
    """Correlation matrix of the parameters in their fitted scales t."""
    combinations: tuple[Combination, ...]
    """Identified products of powers of parameters that are not identified alone."""
    noise: tuple[Noise, ...]
    residuals: tuple[_FileResiduals, ...]
    held: Mapping[str, float]
    """Standard deviations, SI, of uncertain inputs of the scene that were not fitted, by name; all intervals
    include their effect."""
    pulls: Mapping[str, float]
    """Most likely error of each held input, over its expanded uncertainty (95 %)."""
    loss: str
    starts: int
    evaluations: int
    """Number of predictions of all data."""
    log_likelihood: float
    """Log likelihood at the optimum, with priors and held inputs, without constants."""
    scene: Any
    """Scene with fitted values, most likely values of held inputs, and corrected models."""
    stated: Any
    """Scene as stated before the fit."""
    joint: Joint
    """Joint distribution of parameters and held inputs."""
    optimum: Optimum
    """Optimum of the likelihood."""

    @property
    def pulled(self) -> tuple[Finding, ...]:
        """Findings on held inputs that the data pull out of their stated interval."""
        return tuple(
            Finding(code="pulled", values={"name": name, "pull": abs(pull)})
            for name, pull in self.pulls.items()
            if abs(pull) > 1
        )

    @cached_property
    def exact(self) -> tuple[str, ...]:
        """Names of quantities that the predictions depend on, neither fitted nor stated as uncertain."""
        problem, t = self.optimum.residuals.problem, self.optimum.t
        inputs = inputs_of(problem.scene)
        uncertain = {*inputs.held(()), *(parameter.name for parameter in self.parameters)}
        exact = []
        for name, each in inputs.inputs.items():
            nearby = inputs.changed(name, -_LITTLE * abs(each.value) if each.value else _LITTLE)
            if name not in uncertain and np.any(replace(problem, scene=nearby).at(t) != problem.at(t)):
                exact.append(name)
        return tuple(exact)

    def parameter(self, name: str) -> FittedParameter:
        """Fitted parameter by name. Raises: KeyError: it was not fitted."""
        return {each.name: each for each in self.parameters}[name]


Loss = Literal["linear", "soft_l1"]
_STARTS: Final = 3
_HALF: Final = 0.5


def fit(
    scene: AnyScene,
    *,
    data: Sequence[Observations],
    parameters: Sequence[str] | None = None,
    loss: Loss = "linear",
    starts: int = _STARTS,
) -> FitResult:
    """Fit parameters of a scene to measurements.

    Args: `parameters`: names; None: those that the kinds of data inform. `loss`: "linear" (normal noise) or
        "soft_l1" (outliers count less). `starts`: number of searches, from the scene and around it.
    Raises: FitError: data or parameters that cannot be fitted. ValueError: data that do not fit the scene.
    Source: `likelihood`, `optimisation`, `intervals`, `identifiability`.
    """
    best, held = optimum_as_stated(problem_of(scene, data, parameters), loss=loss, starts=starts)
    best = about_pulls(best, held, scene=scene, loss=loss)
    residuals, problem, spread = best.residuals, best.residuals.problem, covariance(best.slopes)
    slopes = best.slopes[: best.slopes.shape[0] - int(np.count_nonzero(problem.with_prior))]
    intervals = profiles(best, spread)
    identified = verdicts(problem.parameters, best.t, slopes, intervals)
    products = combinations(problem.parameters, best.t, slopes, identified, intervals)
    fitted = zip(problem.parameters, best.t.tolist(), intervals, identified, strict=True)
    size = np.sqrt(np.diag(spread))
    groups = zip(problem.estimated_groups, residuals.noise.tolist(), best.freedom.tolist(), strict=True)
    stated = dict.fromkeys(b.group for b in problem.blocks if not b.estimated)
    noise = [Noise(group=g, standard_deviation=s, estimated=True, degrees_of_freedom=f) for g, s, f in groups]
    noise += [
        Noise(group=g, standard_deviation=None, estimated=False, degrees_of_freedom=None) for g in stated
    ]
    # Normalised residuals, with the other unknowns eliminated.
    normalised, files = best.at[: problem.measured.size] / np.sqrt(residuals.weights), []
    for block, mine in problem.rows:
        data_set, weights = block.observations, block.observations.rows_of(residuals.weights[mine])
        files.append(
            _FileResiduals(
                file=data_set.file,
                kind=data_set.kind,
                lines=data_set.lines,
                normalised=data_set.rows_of(normalised[mine]),
                down_weighted=np.asarray(np.min(weights, axis=1) < _HALF),
            )
        )
    whitening = sum(float(np.sum(np.log(np.diag(b.whiten)))) for b in problem.blocks)
    noises = float(np.sum(np.log(residuals.noise[problem.group[problem.group >= 0]])))
    return FitResult(
        parameters=tuple(_fitted(*each, products) for each in fitted),
        correlations=spread / np.outer(size, size),
        combinations=products,
        noise=tuple(noise),
        residuals=tuple(files),
        held=held,
        pulls=dict(zip(held, (residuals.linear_values(best.t)[1] / NORMAL_95).tolist(), strict=True)),
        loss=loss,
        starts=best.starts,
        evaluations=problem.evaluations,
        log_likelihood=whitening - noises - float(np.sum(best.at**2)) / 2,
        scene=scene_as_fitted(best, held),
        stated=scene,
        joint=joint_of(best, held),
        optimum=best,
    )


def problem_of(
    scene: AnyScene, data: Sequence[Observations], parameters: Sequence[str] | None = None
) -> Problem:
    """Problem that `fit` solves. Raises: FitError: see `fit`."""
    if not data:
        raise FitError("give at least one file of measurements")
    for each in data:
        if each.kind not in kinds_of(scene.balancer):
            raise FitError(f"{each.file}: data of kind {each.kind} do not belong to this balancer")
        if reason := KINDS[each.kind].obstacle(scene, each):
            raise FitError(f"{each.file}: {reason}")
    inputs = inputs_of(scene)
    names = inputs.informed(data) if parameters is None else list(parameters)
    return Problem(
        scene=scene,
        models=inputs.models,
        parameters=inputs.parameters(names),
        blocks=tuple(DataBlock(observations=each) for each in data),
    )


def _fitted(
    parameter: Parameter, t: float, profile: Profile, verdict: Identified, products: Sequence[Combination]
) -> FittedParameter:
    before, text = None, text_of("told_apart_by_data")
    source: Source | None = None
    if parameter.prior:
        source = "geometry" if parameter.by_geometry else "[uncertainty]"
        width = NORMAL_95 * parameter.prior
        before = parameter.start - width, parameter.start + width
    if verdict is not Identified.IDENTIFIED:
        never = verdict is Identified.STRUCTURALLY
        within = " and ".join(c.text for c in products if parameter.name in c.names)
        sentences = [
            text_of("told_apart_by_none" if never else "hardly_narrowed", verdict=str(verdict)),
            *([text_of("products_identified", products=within)] if within else []),
            text_of(_INTERVAL_FROM[source]),
        ]
        text = "; ".join(sentences)
    return FittedParameter(
        name=parameter.name,
        value=parameter.value(t),
        interval=(parameter.value(profile.low), parameter.value(profile.high)),
        at_bound=(profile.low_bound, profile.high_bound),
        before=parameter.start,
        before_interval=before,
        before_source=source,
        verdict=verdict,
        text=text,
        profile=profile,
        curve=tuple((parameter.value(at), rise / profile.factor**2) for at, rise in profile.points),
    )
