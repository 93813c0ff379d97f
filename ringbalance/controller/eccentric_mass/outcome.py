"""Outcomes of a run of two eccentric masses."""

from __future__ import annotations

from enum import StrEnum
from typing import Final


class EccentricOutcome(StrEnum):
    """Outcome of a run."""

    SETTLED = "settled"
    RISES_AGAIN = "rises_again"
    SATURATED = "saturated"
    RESIDUAL = "residual"
    TUNING_TIME = "tuning_time"
    SPEED_CHANGED = "speed_changed"
    TOO_SLOW = "too_slow"
    SPEED_NOT_CONSTANT = "speed_not_constant"
    MASSES_MOVE = "masses_move"
    IMBALANCE_UNCERTAIN = "imbalance_uncertain"
    FRICTION_UNCERTAIN = "friction_uncertain"
    STALLED = "stalled"
    NOT_ARRIVED = "not_arrived"
    TIME_LIMIT = "time_limit"
    DIVERGED = "diverged"
    LOCKED = "locked"


OF_DRIVES: Final = frozenset(
    {
        EccentricOutcome.TIME_LIMIT,
        EccentricOutcome.NOT_ARRIVED,
        EccentricOutcome.MASSES_MOVE,
        EccentricOutcome.STALLED,
        EccentricOutcome.FRICTION_UNCERTAIN,
    }
)
"""Outcomes that unstable drives, or drives that overcompensate friction, may cause."""
