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
    bends_before: tuple[int, int] | None = None
    """Bends between either chamber and the crest's end; None: as many as lie there when spread evenly."""


FINEST_MODELS: Final = TubeModels()
