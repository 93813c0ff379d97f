"""Which model serves each part of the loss of a tube: chosen for a tolerance, so no key of a scene file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

LEFT_OUT: Final = "left out"
CORRELATION: Final = "correlation"
FINEST: Final = "finest"
Fidelity = Literal["left out", "correlation", "finest"]
"""In order of cost."""


@dataclass(frozen=True, kw_only=True)
class TubeModels:
    """Model of each part of the loss; by default the finest of each."""

    constant: float | None = None
    """k in place of the sum of its parts."""
    roughness: Fidelity = FINEST
    """Left out: a smooth wall."""
    rotation: Fidelity = FINEST
    """The finest takes laminar flow from finite elements."""
    bends: Fidelity = FINEST
    """Left out: their arcs as straight tube; by correlation: as if all flow were turbulent."""
    ends: Fidelity = FINEST
    """Left out: no entrance loss, alpha = 1; by correlation: as if all flow were turbulent."""
    errors: tuple[tuple[str, float, float], ...] = ()
    """Errors of the models themselves, supposed or drawn: cause, and two parts in standard deviations, of
    which the second belongs to k alone; see `physics.tube.uncertainty.with_errors`."""

    def error(self, cause: str) -> float:
        """First part of a cause's errors together."""
        return sum(first for name, first, _ in self.errors if name == cause)


CLEARING_ERROR: Final = "clearing of the crest"
CAVITY_ERROR: Final = "pressure of the cavity"
START_ERROR: Final = "start of the flow"
"""Causes of `TubeModels.errors` beside those of k."""
FINEST_MODELS: Final = TubeModels()
