"""The record of one run with two eccentric masses, frozen, and what it is judged by."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.run_loop import Record
from ringbalance.controller.eccentric_mass.strategy.targets import Targets
from ringbalance.results.result import PresentedResult
from ringbalance.results.rows import Finding
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray

_NOTHING: Final = 1e-6
"""Share of the limit below which a vibration is round-off."""
_FINAL_TIME: Final = 1.0
"""Over which the final amplitude is averaged, s."""


class EccentricOutcome(StrEnum):
    """How a run ended."""

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


@dataclass(frozen=True, kw_only=True)
class Remedy:
    """Values of the scene that are changed together."""

    changes: tuple[tuple[str, float | str], ...]
    """Key, such as "lqr.state_weight", and new value in SI."""
    text: str


@dataclass(frozen=True, kw_only=True)
class StageSpan:
    """One stage of the strategy."""

    name: str
    start: float
    """s."""
    end: float
    """s."""


@dataclass(frozen=True, kw_only=True, repr=False)
class EccentricRun(PresentedResult):
    """One run of the whole strategy on the plant."""

    balancer: str
    """ "eccentric_mass"."""
    scene: str
    """Its name."""
    source: str
    """File name of the scene without its folder."""
    sha256: str
    """Of the scene."""
    outcome: EccentricOutcome
    settled: bool
    """Whether the amplitude ends at or below the limit and stays there."""
    settling_time: float | None
    """s, from which on the amplitude stays at or below the limit; None when not settled."""
    ended: Finding
    """How the run ended."""
    warned: tuple[Finding, ...]
    """What the user should know although the run continued."""
    remedies: tuple[Remedy, ...]
    """Each by itself, the likeliest first; empty for a settled run, and where no single value will do."""
    innovation: float | None
    """Mean square of the imbalance filter's normalised innovations: 1 for a true model; None without any."""
    limit: float
    """m."""
    time: FloatArray
    """s, shape (n,)."""
    speed: FloatArray
    """W, rad/s, shape (n,)."""
    whirl: ComplexArray
    """True displacement of the rotor along its own axes, m, shape (n,)."""
    mass_angle: FloatArray
    """True angles of the masses, rad, not wrapped, shape (2, n)."""
    mass_rate: FloatArray
    """rad/s, shape (2, n)."""
    goal: FloatArray
    """Where the masses should be, rad, shape (2, n)."""
    voltage: FloatArray
    """V, shape (2, n)."""
    drive_off: BoolArray
    """Whether both drives are off, shape (n,)."""
    energy: FloatArray
    """Electrical, taken from the supply since the start, J, shape (n,)."""
    estimates: Record
    """Those of the filters are constant outside their stages; their covariances are of the noise alone."""
    rotor_covariance: FloatArray
    """Of the estimated imbalance, from what the scene states of rotor and masses, kg^2 m^2, shape (2, 2)."""
    stages: tuple[StageSpan, ...]
    targets: Targets | None
    """For the imbalance as it was estimated; None when it never came to that."""
    unbalanced_amplitude: float
    """Steady amplitude that the masses' first places would give at the last speed, m."""

    @property
    def status(self) -> str:
        """How the run ended and what to do next."""
        return ": ".join([self.ended.text, *self._advice])

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know, as sentences."""
        return tuple(each.text for each in self.warned)

    @property
    def _advice(self) -> list[str]:
        return [", or ".join(remedy.text for remedy in self.remedies)] if self.remedies else []

    @property
    def amplitude(self) -> FloatArray:
        """True vibration, m zero-to-peak, shape (n,)."""
        return np.asarray(np.abs(self.whirl), dtype=np.float64)

    @property
    def phase(self) -> FloatArray:
        """Of the true vibration in the rotor's frame, rad within (-pi, pi], shape (n,)."""
        return np.asarray(np.angle(self.whirl), dtype=np.float64)

    @property
    def imbalance_covariance(self) -> FloatArray:
        """Of the imbalance as estimated at the end, from noise and rotor, kg^2 m^2, shape (2, 2)."""
        return np.asarray(self.estimates.imbalance_covariance[-1] + self.rotor_covariance)

    @property
    def final_amplitude(self) -> float:
        """Mean over the last second, m."""
        last = self.time >= self.time[-1] - _FINAL_TIME
        return float(np.mean(self.amplitude[last]))

    @property
    def residual_ratio(self) -> float | None:
        """Final amplitude over that of the first places at this speed; None where nothing would vibrate."""
        if self.unbalanced_amplitude < _NOTHING * self.limit:
            return None
        return self.final_amplitude / self.unbalanced_amplitude

    @property
    def electrical_energy(self) -> float:
        """Taken by both motors in the whole run, J."""
        return float(self.energy[-1])

    @property
    def worst_amplitude(self) -> float:
        """Largest true vibration on the way, m."""
        return float(np.max(self.amplitude))
