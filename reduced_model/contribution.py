"""Estimated contribution of one thing that a model may leave out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

NEGLIGIBLE: Final = 1e-3
"""Of the tolerance: a smaller contribution is left out unchecked."""


@dataclass(frozen=True, kw_only=True)
class Contribution:
    """What leaving one thing out is worth, judged before anything is solved."""

    term: str
    """Name, as in `Fidelity.leaves_out`."""
    value: float | None
    """Relative to the quantity; None where the scene gives no basis for an estimate."""
    formula: str
    source: str
    rough: bool = False
    """Whether it may be far too large, so that no model is ruled out by it alone."""
