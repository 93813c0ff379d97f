"""A fit in a scene file: the joint distribution of inputs and model errors, and keys that correct models."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Annotated, Final, Literal, cast, get_args

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.keys.declaration import UNKNOWN, Listed, Shown, needed, standard
from ringbalance.scene.keys.fields import NOT_NEGATIVE, POSITIVE, Bounds, OneLine, each_of, number, quantity
from ringbalance.scene.units import unit_factor

NO_UNIT: Final = "1"
MODEL: Final = "model: "
"""Prefix of a model error's name; the cause follows and, for errors of k, the part."""


GaugeCorrection = Annotated[
    float,
    quantity("pressure"),
    standard(
        "0 kPa",
        "`pressure` less what the gauge shows of it, which `ringbalance fit` adds to the gas pressures of "
        "measurements, and writes",
    ),
]


@dataclass(frozen=True, kw_only=True)
class FittedQuantity:
    """One quantity of a joint normal distribution, whose mean is the scene's value."""

    quantity: Annotated[
        OneLine,
        needed(
            'its path, such as "tube.bore" or "masses.friction_arm[0]", or an error of a model in '
            '`model_errors`, such as "model: ends, even"'
        ),
    ]
    unit: Annotated[OneLine, needed("of the standard deviation; 1 for none")]
    standard_deviation: Annotated[float, number(POSITIVE), needed("of the quantity, in that unit")]
    correlations: Annotated[
        tuple[float, ...],
        each_of(number(Bounds()), example="[1, -0.9]"),
        needed("with every quantity of the list, in its order; 1 with itself"),
    ]

    @property
    def key(self) -> str:
        """Name of an input without its table, "bore" of "tube.bore"; full name of a model error."""
        return self.quantity if self.quantity.startswith(MODEL) else self.quantity.split(".")[1]


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """Quantities that were fitted together, or that a fit has moved."""

    quantities: Annotated[
        tuple[FittedQuantity, ...],
        standard([], "quantities with a joint distribution, used in place of what [uncertainty] has of them"),
        Listed(
            '[{ quantity = "tube.bore", unit = "mm", standard_deviation = 0.01, correlations = [1, -0.9] }, '
            "...]"
        ),
    ] = ()

    @cached_property
    def deviations(self) -> FloatArray:
        """Standard deviations, SI, shape (n,)."""
        return np.array([each.standard_deviation * unit_factor(each.unit) for each in self.quantities])

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance, SI, shape (n, n)."""
        count = len(self.quantities)
        correlations = np.array([each.correlations for each in self.quantities]).reshape(count, count)
        return np.asarray(correlations * np.outer(self.deviations, self.deviations))

    def directions(self, which: FloatArray | None = None) -> FloatArray:
        """Independent changes of one standard deviation each, whose sum of outer products is the covariance.

        Args: `which`: indices of some of the quantities; their marginal distribution.
        Returns: SI, shape (quantities, directions), largest first; those of round-off are left out.
        """
        chosen = np.arange(len(self.quantities)) if which is None else which.astype(np.int64)
        if chosen.size == 0:
            return np.zeros((0, 0))
        size = self.deviations[chosen]
        values, vectors = np.linalg.eigh(self.covariance[np.ix_(chosen, chosen)] / np.outer(size, size))
        significant = values > _ROUND_OFF * values[-1]
        return np.asarray((size[:, None] * vectors[:, significant] * np.sqrt(values[significant]))[:, ::-1])

    def drawn(self, random: np.random.Generator) -> FloatArray:
        """One draw of the changes of all quantities, SI, shape (n,)."""
        directions = self.directions()
        return np.asarray(directions @ random.standard_normal(directions.shape[1]))


_ROUND_OFF: Final = 1e-10
"""Smallest eigenvalue of the correlations that counts, over the largest; files state nine digits."""


CLEARING_ERROR: Final = "clearing of the crest"
CAVITY_ERROR: Final = "pressure of the cavity"
START_ERROR: Final = "start of the flow"
CREST_ERROR: Final = "end of the crest"
HOLE_ERROR: Final = "discharge of the gas hole"
JET_ERROR: Final = "decay of the gas jet"
"""Causes of `ModelError` other than errors of k."""
ErrorCause = Literal[
    "friction correlation",
    "rotation model",
    "rotation entry",
    "ends",
    "bends",
    "friction as built",
    "rotation as built",
    "entrance as built",
    "bends as built",
    "clearing of the crest",
    "pressure of the cavity",
    "start of the flow",
    "end of the crest",
    "discharge of the gas hole",
    "decay of the gas jet",
]
"""Cause of an error of a model: the keys of `scene.errors.MODEL_KINDS`."""
ERROR_NAME: Final = re.compile(r"model: ([^,]+)(?:, (even|odd))?")
"""Name of a model error: cause and part; the even part where none is named."""
LARGEST_ERROR: Final = 2.5
"""Largest error, standard deviations: beyond, a head may fall with the velocity."""
_Deviations = Annotated[float, number(Bounds(at_least=-100, at_most=100))]


@dataclass(frozen=True, kw_only=True)
class ModelError:
    """Assumed, drawn or fitted error of a model, in standard deviations of its stated uncertainty.

    `physics.tube.loss.with_errors` defines the two parts; a cause other than of k has only `even`.
    """

    cause: Annotated[ErrorCause, needed("model that is off")]
    even: Annotated[
        _Deviations, standard(0.0, "part n of k's error (U/1.96) (n cos ln Re + m sin ln Re), or the error")
    ] = 0.0
    odd: Annotated[_Deviations, standard(0.0, "part m of k's error")] = 0.0

    @classmethod
    def named(cls, name: str, size: float) -> ModelError:
        """Error with a name as in fits and in [fitted], such as "model: ends, even".

        Args: `size`: in standard deviations. Raises: ValueError: there is no such error.
        """
        cause, odd = error_part(name)
        return cls(cause=cause, odd=size) if odd else cls(cause=cause, even=size)


@cache
def error_part(name: str) -> tuple[ErrorCause, int]:
    """Cause of an error by its name, and 1 for the odd part, else 0. Raises: ValueError: no such error."""
    match = ERROR_NAME.fullmatch(name)
    if match is None or match[1] not in get_args(ErrorCause):
        raise ValueError(f"{name!r} names no error of a model")
    return cast(ErrorCause, match[1]), int(match[2] == "odd")


ModelErrors = Annotated[
    tuple[ModelError, ...],
    standard(
        [],
        "corrections of the tube's models, in standard deviations of each model's stated uncertainty; "
        "`ringbalance fit` writes them",
    ),
    Listed('[{ cause = "friction correlation", even = 0.4, odd = -0.1 }, ...]'),
]
ExtraLoss = Annotated[
    float,
    number(NOT_NEGATIVE),
    standard(0.0, "any further loss coefficient, on the velocity head in the tube"),
    UNKNOWN,
    Shown("further loss coefficient"),
]
DrawDownFactor = Annotated[
    float,
    number(POSITIVE),
    standard(1.0, "depth over a port at which gas enters it, over the calculated one, 30 % uncertain"),
    UNKNOWN,
    Shown("factor on the draw-down depth"),
]
