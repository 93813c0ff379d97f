"""What the valve and line of a chamber let through at the least, and at what valve-open time.

A line that a scene does not give is a range, not an absence: conductances of small valves behind a rotary
distributor and their switching times, of which both ends are answered for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from ringbalance.physics.gas import GasLine
from ringbalance.scene.models import Gas, Scene

DEFAULT_CONDUCTANCES: Final = (0.2e-8, 1e-8)
"""C of small valves with a rotary distributor, slow and fast, m^3/(s Pa): 0.2 and 1 l/(s bar)."""
DEFAULT_LAGS: Final = (10e-3, 5e-3)
"""Of small solenoid valves, slow and fast, s."""
DEFAULT_CRITICAL_RATIO: Final = 0.3
"""Between 0.5 of a nozzle and 0.2 of a long line."""


@dataclass(frozen=True, kw_only=True)
class LineEnd:
    """One gas line that answers are given for."""

    name: str
    """ "given", or "slow" and "fast", the ends of the default range."""
    line: GasLine
    valve_lag: float
    """s."""


@dataclass(frozen=True, kw_only=True)
class LineAnswer:
    """What a pair at equal fills can do with one gas line."""

    end: str
    conductance: float
    """C, m^3/(s Pa)."""
    critical_ratio: float
    valve_lag: float
    """s."""
    filling_time: float
    """From ambient to the supply's pressure, s."""
    choked_filling_time: float
    """The same if the line were choked to the end, a lower bound, s."""
    venting_time: float
    """Back to ambient, s."""
    shortest_opening: float | None
    """Shortest valve-open time whose effect is sure, s: it primes the tube; None: the gas starts no flow, or
    what it moves runs back."""
    smallest_correction: float | None
    """Change of the vibration by the shortest opening, m."""
    dead_time: float | None = None
    """Valve-open time that an injection of the size of the limit loses against the steady velocity, s."""
    holds: bool | None = True
    """Whether what an injection moves stays moved with the gas off; None: likely, as `TubePath.holds`."""


def line_ends(scene: Scene) -> tuple[LineEnd, ...]:
    """The scene's gas line, or the slow and the fast end of the default range of what it does not give."""
    gas = scene.gas
    if gas.conductance is not None and gas.valve_lag is not None:
        return (_end(gas, "given", 0),)
    return _end(gas, "slow", 0), _end(gas, "fast", 1)


def _end(gas: Gas, name: str, place: int) -> LineEnd:
    line = GasLine.with_conductance(
        gas,
        conductance=DEFAULT_CONDUCTANCES[place] if gas.conductance is None else gas.conductance,
        critical_ratio=DEFAULT_CRITICAL_RATIO if gas.critical_ratio is None else gas.critical_ratio,
    )
    return LineEnd(
        name=name, line=line, valve_lag=DEFAULT_LAGS[place] if gas.valve_lag is None else gas.valve_lag
    )


def line_text(answers: tuple[LineAnswer, ...]) -> str:
    """What the shortest opening that primes the tube at equal fills corrects, in one phrase."""
    if answers[0].holds is False:
        return "what an injection moves runs back while the gas is off"
    if any(answer.smallest_correction is None for answer in answers):
        return "the gas starts no flow at equal fills"
    whose = "the scene's" if answers[0].end == "given" else "not in the scene, default range"
    each = [f"{1e6 * (answer.smallest_correction or 0.0):.2g} um{_which(answer)}" for answer in answers]
    what = "the shortest opening that primes the tube at equal fills corrects"
    lasts = "" if answers[0].holds else "; whether it lasts hangs on the pressure of a cavity over the crest"
    return f"{whose}: {what} {' or '.join(each)}, shorter ones less{lasts}"


def line_document(answers: tuple[LineAnswer, ...]) -> dict[str, Any]:
    """For JSON, in SI."""
    return {
        "given": answers[0].end == "given",
        "holds": answers[0].holds,
        "ends": [
            {
                "end": answer.end,
                "conductance_m3_per_s_Pa": answer.conductance,
                "critical_ratio": answer.critical_ratio,
                "valve_lag_s": answer.valve_lag,
                "filling_time_s": answer.filling_time,
                "choked_filling_time_s": answer.choked_filling_time,
                "venting_time_s": answer.venting_time,
                "shortest_opening_s": answer.shortest_opening,
                "smallest_correction_m": answer.smallest_correction,
                "dead_time_s": answer.dead_time,
            }
            for answer in answers
        ],
        "text": line_text(answers),
    }


def _which(answer: LineAnswer) -> str:
    opening = f"{1e3 * (answer.shortest_opening or 0.0):.2g} ms"
    if answer.end == "given":
        return f" in {opening}"
    numbers = f"{opening}; {1e8 * answer.conductance:.2g} l/(s bar), {1e3 * answer.valve_lag:.2g} ms lag"
    return f" ({answer.end}: {numbers})"
