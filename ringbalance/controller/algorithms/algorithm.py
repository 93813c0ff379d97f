"""The interface of every control algorithm: a pure step from state and measurement to state and command."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from operator import index
from typing import Protocol, TypeVar

StateT = TypeVar("StateT")


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One sample of the vibration; a sensor may deliver NaN, or no sample at all (None in its place).

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> def exact(time, vibration):
        ...     return rb.Measurement(time=time, amplitude=abs(vibration), phase=cmath.phase(vibration))
        >>> sensor: rb.Sensor = exact
        >>> rb.simulate(scene, sensor=sensor).settled
        True
    """

    time: float
    """s."""
    amplitude: float
    """m, zero-to-peak."""
    phase: float
    """rad, up to a multiple of a full turn."""
    at_residual: tuple[bool, ...] = ()
    """True for every chamber that a sensor reports as empty; an empty tuple: there is no such sensor."""


@dataclass(frozen=True, kw_only=True)
class ValveCommand:
    """Gas into one chamber for a time; the valves of one command open together.

    Example:
        >>> rb.ValveCommand(chamber=2, duration=0.02).chamber
        2
    """

    chamber: int
    """Index of the driven chamber, A = 0."""
    duration: float
    """s, above zero."""

    def __post_init__(self) -> None:
        """Refuse a negative chamber index, and a duration that is not positive and finite."""
        if index(self.chamber) < 0:
            raise ValueError(f"chamber {self.chamber}: chambers are counted from 0, which is A")
        if not 0.0 < self.duration < inf:
            raise ValueError(f"a valve cannot open for {self.duration} s: leave it out of the command")


@dataclass(frozen=True, kw_only=True)
class Command:
    """Command of an algorithm: valves to open, or none.

    Example:
        >>> valve = rb.ValveCommand(chamber=0, duration=0.02)
        >>> rb.Command(valves=(valve,)).valves[0].duration
        0.02
    """

    valves: tuple[ValveCommand, ...] = ()
    resting: bool = False
    """True if the algorithm rests: the amplitude is not above its limit."""
    reason: str = ""
    """Reason for which no valve opens although the algorithm does not rest; empty otherwise."""


class Controller(Protocol[StateT]):
    """A control algorithm: settings are its fields, everything that changes is in the state.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> class Nothing:
        ...     rises_tolerated = 3
        ...
        ...     def start(self):
        ...         return None
        ...
        ...     def step(self, state, measurement):
        ...         return state, rb.Command(resting=True)
        >>> nothing: rb.Controller = Nothing()
        >>> len(rb.simulate(scene, controller=nothing).injections)
        0
    """

    @property
    def rises_tolerated(self) -> int:
        """Number of operations in a row, each followed by a rise of the amplitude, that a run tolerates.

        One rise more ends the run; so do this many if the amplitude is then above the first sample.
        """
        ...

    def start(self) -> StateT:
        """The state before the first sample."""
        ...

    def step(self, state: StateT, measurement: Measurement | None) -> tuple[StateT, Command]:
        """Next state and command after one sample (None: dropped); a pure function."""
        ...
