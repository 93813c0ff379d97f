"""Valve of a scene: its conductance, critical ratio and lag from a catalogue or from the flow that it states.

Values that the scene gives take precedence.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from ringbalance.scene.faults import Fault, did_you_mean
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.toml import toml_text
from ringbalance.scene.units import format_quantity
from ringbalance.scene.valves import FLOWS, Valve, find_valve, known_valves

_OF_VALVE: Final = frozenset({"gas.conductance", "gas.critical_ratio", "gas.valve_lag"})


def with_valve(reading: SceneReading) -> tuple[SceneReading, tuple[Fault, ...]]:
    """The reading with conductance, critical ratio and lag of its valve; and the errors."""
    at_hand = tuple(_faults_at_hand(reading))
    stated = [key for key in (*FLOWS, "valve") if not reading.lacks(f"gas.{key}")]
    # Of a valve that cannot be read nothing is known, and nothing further is missing.
    unread = replace(reading, broken=reading.broken | _OF_VALVE)
    if len(stated) > 1:
        problem = f"{stated[0]} states the flow of the valve already"
        fault = reading.fault(
            f"gas.{stated[1]}", problem=problem, allowed=f"one of {', '.join(FLOWS)}, valve"
        )
        return unread, (fault, *at_hand)
    if not stated or not reading.known(f"gas.{stated[0]}") or "gas.critical_ratio" in reading.broken:
        return unread if stated else reading, at_hand
    (key,) = stated
    value, ratio_stated = reading.values[f"gas.{key}"], reading.values.get("gas.critical_ratio")
    valve = find_valve(value) if key == "valve" else Valve(name="", **{key: value})
    if valve is None:
        problem = f"the catalogue has no valve of that name{did_you_mean(value, known_valves())}"
        allowed = f"{', '.join(known_valves())}; or one of {', '.join(FLOWS)}"
        return unread, (reading.fault("gas.valve", problem=problem, allowed=allowed), *at_hand)
    valve = valve if ratio_stated is None else replace(valve, critical_ratio=ratio_stated)
    conductance, ratio = valve.iso_6358
    shown = format_quantity(conductance, "conductance", "l/(s*bar)", digits=3)
    text = f"{key} = {toml_text(reading.document['gas'][key])}"
    if converted := key != "conductance" or ratio_stated is None:
        text += f" is C = {shown} with b = {ratio:.3g} (ISO 6358)"
    values = {"gas.critical_ratio": ratio, "gas.valve_lag": valve.valve_lag, "gas.conductance": conductance}
    values = {path: each for path, each in values.items() if each is not None and reading.lacks(path)}
    if valve.critical_ratio is None:
        text += ", as no critical ratio is stated"
        reading = reading.adding({"gas.critical_ratio": values.pop("gas.critical_ratio")})
    text += _remarks(reading, valve)
    if assumed := valve.valve_lag is None and reading.lacks("gas.valve_lag"):
        text += f"; a valve_lag of {1e3 * valve.lag:g} ms is assumed, as none is stated: ask the seller"
        reading = reading.assuming({"gas.valve_lag": valve.lag})
    source = {"gas.valve_source": text} if converted or assumed else {}
    return reading.converting({**values, **source}), at_hand


def _remarks(reading: SceneReading, valve: Valve) -> str:
    """Source of a valve of the catalogue, how it is connected, and what that does not allow."""
    if not valve.source:
        return ""
    text = f"; {valve.source}"
    if valve.kind.startswith("5/2"):
        text += "; it is a 5/2 valve: one for each chamber, with one outlet plugged"
    ends, pressure = (valve.lowest_pressure, valve.highest_pressure), reading.values.get("gas.pressure")
    low, high = ends
    if pressure is not None and not (low or 0.0) <= pressure <= (high or math.inf):
        limits = " to ".join(f"{each / 1e5:g}" for each in ends if each is not None)
        text += f"; it is made for {limits} bar, and gas.pressure is {pressure / 1e5:.3g} bar"
    return text


def _faults_at_hand(reading: SceneReading) -> Iterator[Fault]:
    """Yield errors of the valves in [design]: no flow or two."""
    for number, each in enumerate(reading.values.get("design.valves", ()), 1):
        valve, table = each.completed, {"file": reading.file, "table": "design"}
        if len(valve.flows) != 1:
            count = "no flow is stated" if not valve.flows else f"{' and '.join(valve.flows)} state one thing"
            hint = did_you_mean(each.name, known_valves())
            allowed = f"one of {', '.join(FLOWS)}, or a name of the catalogue{hint}"
            yield Fault(**table, key=f"valves[{number}]", problem=count, allowed=allowed)
