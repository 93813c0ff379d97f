"""Errors of the models themselves, supposed, drawn or fitted, and the keys of a tube that correct them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Final, Literal, cast, get_args

from ringbalance.scene.keys.declaration import UNCERTAIN, Listed, Shown, needed, standard
from ringbalance.scene.keys.fields import NOT_NEGATIVE, POSITIVE, Bounds, number

CLEARING_ERROR: Final = "clearing of the crest"
CAVITY_ERROR: Final = "pressure of the cavity"
START_ERROR: Final = "start of the flow"
"""Causes of `ModelError` beside those of k."""
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
]
"""What a model may be off by: those of k, as `physics.tube.loss.MODEL_CAUSES`, and those above."""
ERROR_NAME: Final = re.compile(r"model: ([^,]+)(?:, (even|odd))?")
"""Name of one standard deviation of a cause's even part, where none is named, or of its odd part."""
LARGEST_ERROR: Final = 2.5
"""Standard deviations that an error is moved to at most: beyond, a head may fall with the velocity."""
Deviations = Annotated[float, number(Bounds(at_least=-100, at_most=100))]


@dataclass(frozen=True, kw_only=True)
class ModelError:
    """Error of a model itself, supposed, drawn or fitted, in standard deviations of its stated uncertainty.

    What the parts do stands with `physics.tube.loss.with_errors`; of a cause beside k the first alone
    counts.
    """

    cause: Annotated[ErrorCause, needed("model that is off")]
    even: Annotated[
        Deviations, standard(0.0, "part n of k's error (U/1.96) (n cos ln Re + m sin ln Re), or the error")
    ] = 0.0
    odd: Annotated[Deviations, standard(0.0, "part m of k's error")] = 0.0

    @classmethod
    def named(cls, name: str, size: float) -> ModelError:
        """An error by the name that fits and [fitted] give it, such as "model: ends, even".

        Args: `size`: in standard deviations. Raises: ValueError: there is no such error.
        """
        match = ERROR_NAME.fullmatch(name)
        if match is None or match[1] not in get_args(ErrorCause):
            raise ValueError(f"{name!r} names no error of a model")
        cause = cast(ErrorCause, match[1])
        return cls(cause=cause, odd=size) if match[2] == "odd" else cls(cause=cause, even=size)


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
    UNCERTAIN,
    Shown("further loss coefficient"),
]
DrawDownFactor = Annotated[
    float,
    number(POSITIVE),
    standard(1.0, "depth over a port at which gas enters it, over the calculated one, 30 % uncertain"),
    UNCERTAIN,
    Shown("factor on the draw-down depth"),
]
