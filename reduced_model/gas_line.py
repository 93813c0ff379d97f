"""Smallest correction through the valve and line of a chamber, and its valve-open time.

A scene without a gas line has a default range: conductances and switching times of small valves behind a
rotary distributor, with results at both ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from ringbalance.physics.gas import GasLine
from ringbalance.scene.models import Scene

_DEFAULT_CONDUCTANCES_M3_S_PA: Final = (0.2e-8, 1e-8)
"""C of small valves with a rotary distributor, slow and fast: 0.2 and 1 l/(s bar)."""
_DEFAULT_LAGS_S: Final = (10e-3, 5e-3)
"""Switching times of small solenoid valves, slow and fast."""
_DEFAULT_CRITICAL_RATIO: Final = 0.3
"""Critical pressure ratio, between 0.5 of a nozzle and 0.2 of a long line."""


@dataclass(frozen=True, kw_only=True)
class LineEnd:
    """Gas line for which results are given."""

    name: str
    """ "given", or "slow" and "fast", the ends of the default range."""
    line: GasLine
    valve_lag: float
    """Switching time of the valve, s."""


@dataclass(frozen=True, kw_only=True)
class LineAnswer:
    """Effect of one gas line on a pair at equal fills."""

    end: str
    conductance: float
    """C, m^3/(s Pa)."""
    critical_ratio: float
    valve_lag: float
    """Switching time of the valve, s."""
    filling_time: float
    """Time to fill a chamber at equal fills with gas, from ambient to supply pressure, s."""
    choked_filling_time: float
    """Filling time of a line that is choked to the end, a lower bound, s."""
    venting_time: float
    """Time to vent a chamber at equal fills, from supply to ambient pressure, s."""
    shortest_opening: float | None
    """Shortest valve-open time that primes the tube, so that its effect is sure, s; None: the gas starts no
    flow, or the moved liquid runs back."""
    smallest_correction: float | None
    """Change of the vibration by the shortest opening, m."""
    dead_time: float | None = None
    """Valve-open time lost against the steady velocity by an injection that corrects the vibration limit,
    s."""
    holds: bool | None = True
    """True if the moved liquid stays with the gas off; None: likely, as in `TubePath.holds`."""


def line_ends(scene: Scene) -> tuple[LineEnd, ...]:
    """Gas line of the scene, or the slow and the fast end of the default range of missing values."""
    gas = scene.gas
    ends: tuple[tuple[str, int], ...] = (("slow", 0), ("fast", 1))
    if gas.conductance is not None and gas.valve_lag is not None:
        ends = (("given", 0),)
    return tuple(
        LineEnd(
            name=name,
            line=GasLine.with_conductance(
                gas,
                conductance=_DEFAULT_CONDUCTANCES_M3_S_PA[i] if gas.conductance is None else gas.conductance,
                critical_ratio=_DEFAULT_CRITICAL_RATIO if gas.critical_ratio is None else gas.critical_ratio,
            ),
            valve_lag=_DEFAULT_LAGS_S[i] if gas.valve_lag is None else gas.valve_lag,
        )
        for name, i in ends
    )


def line_text(answers: tuple[LineAnswer, ...]) -> str:
    """Correction by the shortest opening that primes the tube at equal fills, in one phrase."""
    if answers[0].holds is False:
        return "what an injection moves runs back while the gas is off"
    if any(answer.smallest_correction is None for answer in answers):
        return "the gas starts no flow at equal fills"
    whose = "the scene's" if answers[0].end == "given" else "not in the scene, default range"
    corrections = []
    for answer in answers:
        opening = f"{1e3 * (answer.shortest_opening or 0.0):.2g} ms"
        line = f" in {opening}"
        if answer.end != "given":
            numbers = f"{1e8 * answer.conductance:.2g} l/(s bar), {1e3 * answer.valve_lag:.2g} ms lag"
            line = f" ({answer.end}: {opening}; {numbers})"
        corrections.append(f"{1e6 * (answer.smallest_correction or 0.0):.2g} um{line}")
    what = "the shortest opening that primes the tube at equal fills corrects"
    lasts = "" if answers[0].holds else "; whether it lasts hangs on the pressure of a cavity over the crest"
    return f"{whose}: {what} {' or '.join(corrections)}, shorter ones less{lasts}"


def line_document(answers: tuple[LineAnswer, ...]) -> dict[str, Any]:
    """Answers as a JSON object, in SI units."""
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
