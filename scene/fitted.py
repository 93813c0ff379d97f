"""The joint distribution that a fit leaves of a scene's inputs and of the errors of its models."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.keys.declaration import Listed, needed, standard
from ringbalance.scene.keys.fields import POSITIVE, OneLine, number, numbers, quantity
from ringbalance.scene.units import unit_factor

NO_UNIT: Final = "1"
MODEL: Final = "model: "
"""What the name of an error of a model begins with; the rest is its cause and, of k's, its part."""


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
        tuple[float, ...], numbers(), needed("with every quantity of the list, in its order; 1 with itself")
    ]

    @property
    def key(self) -> str:
        """As uncertain inputs are named where keys of tables differ: "bore" of "tube.bore"."""
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
        """SI, shape (n, n)."""
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
        kept = values > _ROUND_OFF * values[-1]
        return np.asarray((size[:, None] * vectors[:, kept] * np.sqrt(values[kept]))[:, ::-1])

    def drawn(self, random: np.random.Generator) -> FloatArray:
        """One draw of the changes of all quantities, SI, shape (n,)."""
        directions = self.directions()
        return np.asarray(directions @ random.standard_normal(directions.shape[1]))


_ROUND_OFF: Final = 1e-10
"""Of the largest eigenvalue of the correlations, which files have with nine digits."""
