"""Valves of scenes and of a catalogue, and C and b of ISO 6358 from the flow that a data sheet states."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Annotated, Final

from ringbalance.scene.faults import plain_name
from ringbalance.scene.keys.declaration import needed, unused
from ringbalance.scene.keys.fields import POSITIVE, OneLine, ProperFraction, Time, number, quantity
from ringbalance.scene.platform.files import packaged_rows
from ringbalance.scene.registry import imported
from ringbalance.scene.units import parse_quantity

USUAL_CRITICAL_RATIO: Final = 0.3
"""Critical pressure ratio b of a valve whose data sheet prints none; the catalogue has 0.2 to 0.4."""
FLOWS: Final = ("conductance", "nominal_flow", "Kv", "Cv")
"""Keys of which each states the flow of a valve."""
USUAL_LAG_S: Final = 20e-3
"""Lag of a valve for which neither its user nor the catalogue states one: that of a piloted valve."""
_FASTER_LAGS_S: Final[Mapping[str, float]] = MappingProxyType(
    {"Festo MHA2-MS1H-3/2": 2e-3, "SMC SY3000": 12e-3}
)
"""Lags assumed of valves of the catalogue that are known as faster."""
_NOMINAL_PRESSURES_PA: Final = (7e5, 6e5)
"""Absolute pressures before and behind a valve of its nominal flow, 6 and 5 bar gauge."""
_NORMAL_TO_ANR: Final = 101.325 / 100 * 293.15 / 273.15
"""Volume of gas at 100 kPa and 20 degC, as ISO 6358 counts it, over that at 101.325 kPa and 0 degC."""
_KV_PER_CV: Final = 0.865


@dataclass(frozen=True, kw_only=True)
class Valve:
    """A valve with its line; what its data sheet does not print is None."""

    name: Annotated[OneLine, needed("as it is ordered; of a valve of the catalogue the rest may be left out")]
    conductance: Annotated[
        float | None,
        quantity("conductance", POSITIVE),
        unused("the next three, or the catalogue", "sonic conductance C (ISO 6358)"),
    ] = None
    nominal_flow: Annotated[
        float | None, quantity("flow_rate", POSITIVE), unused("`conductance`", "from 6 to 5 bar gauge")
    ] = None
    Kv: Annotated[float | None, number(POSITIVE), unused("`conductance`", "flow coefficient")] = None
    Cv: Annotated[float | None, number(POSITIVE), unused("`conductance`", "flow coefficient")] = None
    critical_ratio: Annotated[
        ProperFraction | None,
        unused("that of the catalogue, or 0.3", "critical pressure ratio b (ISO 6358)"),
    ] = None
    valve_lag: Annotated[
        Time | None,
        unused("that of the catalogue, else assumed: 20 ms", "time from the command to the valve's motion"),
    ] = None
    kind: str = ""
    """Type by the catalogue, which begins with the numbers of ports and positions, such as "5/2"."""
    lowest_pressure: float | None = None
    """Lowest gauge pressure that it takes, Pa."""
    highest_pressure: float | None = None
    """Highest gauge pressure that it takes, Pa."""
    source: str = ""

    @property
    def flows(self) -> tuple[str, ...]:
        """Keys of the flows that it states."""
        return tuple(key for key in FLOWS if getattr(self, key) is not None)

    @property
    def completed(self) -> "Valve":
        """The valve with what the catalogue has of its name and itself does not state."""
        listed = find_valve(self.name)
        if listed is None:
            return self
        stated = {key: each for key, each in vars(self).items() if each is not None and each != ""}
        flows = dict.fromkeys(FLOWS) if self.flows else {}
        return replace(listed, **{**flows, **stated})

    @property
    def iso_6358(self) -> tuple[float, float]:
        """C, m^3/(s Pa), and b, the usual one where it states none; it states one flow."""
        (key,) = self.flows
        ratio = USUAL_CRITICAL_RATIO if self.critical_ratio is None else self.critical_ratio
        return sonic_conductance(key, getattr(self, key), critical_ratio=ratio), ratio

    @property
    def lag(self) -> float:
        """Its lag, s, or the one assumed of it where neither it nor the catalogue states one."""
        listed, stated = find_valve(self.name), self.completed.valve_lag
        assumed = _FASTER_LAGS_S.get(listed.name, USUAL_LAG_S) if listed else USUAL_LAG_S
        return assumed if stated is None else stated

    @property
    def assumes_lag(self) -> bool:
        """True if neither it nor the catalogue states its lag."""
        return self.completed.valve_lag is None


@cache
def known_valves() -> Mapping[str, Valve]:
    """Valves of the catalogue, by name."""
    dimensions = {"conductance": "conductance", "nominal_flow": "flow_rate", "valve_lag": "time"}
    dimensions |= dict.fromkeys(("lowest_pressure", "highest_pressure"), "pressure")
    valves = {}
    for row in packaged_rows("ringbalance.scene", "data", "valves.csv"):
        values = {key: parse_quantity(row[key], name) for key, name in dimensions.items() if row[key]}
        values |= {key: float(row[key]) for key in ("critical_ratio", "Cv") if row[key]}
        source = ", ".join(filter(None, (row["source"], row["date"])))
        valves[row["name"]] = Valve(name=row["name"], kind=row["type"], source=source, **values)
    return MappingProxyType(valves)


def find_valve(name: str) -> Valve | None:
    """The valve of the catalogue with a name; case, spaces and dashes do not matter."""
    return next(
        (valve for each, valve in known_valves().items() if plain_name(each) == plain_name(name)), None
    )


def taken_ratio(names: Iterable[str]) -> str:
    """Sentence about valves whose critical ratio is the usual one."""
    return f"b = {USUAL_CRITICAL_RATIO} of {', '.join(names)}, as no critical ratio is stated"


def assumed_lag(valves: Iterable[Valve]) -> str:
    """Sentence about valves whose lag is assumed."""
    lags = ", ".join(f"{1e3 * each.lag:g} ms of {each.name}" for each in valves)
    return f"a lag is assumed, as none is stated, {lags}: ask the seller"


def sonic_conductance(key: str, value: float, *, critical_ratio: float) -> float:
    """Sonic conductance C of a valve, m^3/(s Pa), from the flow that its data sheet states.

    Nominal flow q, ANR: C = q/[p_1 (1 - ((p_2/p_1 - b)/(1 - b))^2)^(1/2)].  Kv: choked flow of air by
    IEC 60534-2-1 with x_T = 1 - b, so that both flows choke at one ratio of pressures; Kv = 0.865 Cv.
    Args: `value`: SI; of Kv and Cv a plain number.
    Source: ISO 6358-1; IEC 60534-2-1 as in the library fluids.
    """
    if key == "conductance":
        return value
    before, behind = _NOMINAL_PRESSURES_PA
    if key == "nominal_flow":
        ratio = max(behind / before - critical_ratio, 0.0) / (1.0 - critical_ratio)
        return value / (before * math.sqrt(1.0 - ratio**2))
    # Kv of a valve that passes one normal cubic metre in a second.  Few scenes need the library.
    size = imported("fluids.control_valve:size_control_valve_g")
    air = {"T": 293.15, "MW": 28.96, "mu": 1.82e-5, "gamma": 1.4, "Z": 1.0}
    kv = size(**air, P1=before, P2=0.0, Q=1.0, xT=1.0 - critical_ratio)
    return float(value * (_KV_PER_CV if key == "Cv" else 1.0) / kv * _NORMAL_TO_ANR / before)
