"""Result of a solve: a value, a status whose text says what to do next, and statistics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from ringbalance.scene.arrays import FloatArray


class StatusCode(StrEnum):
    """Outcome of a solve."""

    OK = "ok"
    OUT_OF_RANGE = "out_of_range"
    NOT_CONVERGED = "not_converged"
    NO_RING = "no_ring"


@dataclass(frozen=True, kw_only=True)
class Status:
    """Outcome of a solve and, if it failed, advice on what to do next."""

    code: StatusCode = StatusCode.OK
    text: str = "solved"

    @property
    def ok(self) -> bool:
        """True when the value may be used without reservation."""
        return self.code is StatusCode.OK


@dataclass(frozen=True, kw_only=True)
class Statistics:
    """Operation counts and residuals of a solve; wall time is excluded because it is not reproducible."""

    unknowns: int = 0
    iterations: int = 0
    relative_residual: float = 0.0
    extra: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Values with their uncertainty: arrays of one shape, SI, expanded uncertainties (95 %)."""

    value: FloatArray
    uncertainty: FloatArray
    status: Status = field(default_factory=Status)
