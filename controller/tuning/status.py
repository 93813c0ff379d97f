"""Status of a tuning: what keeps the runs from settling, and what to do about it."""

from __future__ import annotations

from ringbalance.controller.liquid_ring.reach import BEYOND_CAPACITY, RUNS_BACK
from ringbalance.controller.tuning.loop_factor import LoopFactor
from ringbalance.controller.tuning.search import LIMITS, VALVES, Candidate, Search
from ringbalance.controller.tuning.settling import SettlingTimes
from ringbalance.reduced_model.gas_line import largest_correction
from ringbalance.scene.models import Scene


def over_capacity(scene: Scene, beyond: float) -> str:
    """Empty within capacity."""
    limit, start, um = scene.controller.limit, scene.rotor.initial_amplitude, 1e6
    if beyond <= limit:
        return ""
    return (
        f"capacity exceeded: with the liquid at its best {beyond * um:.4g} um remain of {start * um:.4g} um, "
        f"limit {limit * um:.4g} um: {BEYOND_CAPACITY}"
    )


def valves_reach(scene: Scene, *, zone: float, smallest: float) -> bool:
    """Whether valve-open times of these effects, m, leave the limit sure to be reached."""
    limit = scene.controller.limit
    return zone <= limit and smallest <= largest_correction(limit, chambers=scene.disc.chambers)


def status_of(
    scene: Scene,
    loop: LoopFactor,
    *,
    zone: float,
    smallest: float,
    settling: SettlingTimes | None,
    best: Candidate | None,
    found: Search | None,
) -> str:
    """Of a scene as recommended, whose nominal unbalance is within the disc's capacity; lengths in m."""
    limit, um = scene.controller.limit, 1e6
    if loop.rate == 0.0:
        return "no gain: the gas drives no liquid at the balanced fills: raise gas.pressure"
    if best is None or settling is None or not loop.stays:
        return (
            f"no gain keeps the amplitude within {limit * um:.4g} um: the sensor's noise is "
            f"{scene.sensor.amplitude_noise * um:.4g} um: raise controller.limit or average the sensor"
        )
    also = f", with {best.change}" if best.change else ""
    reached = settling.quantiles["p95"]
    if reached is not None:
        return f"tuned{also}: 95 % of the runs settle within {reached:.3g} s"
    if not valves_reach(scene, zone=zone, smallest=smallest) and not settling.out_of_capacity:
        return (
            f"the valve is too slow for the limit of {limit * um:.4g} um: the shortest valve-open time moves "
            f"the vibration by {smallest * um:.4g} um, and up to {zone * um:.4g} um none transfers liquid: "
            f"{_ways_out(found)}"
        )
    return _unsettled(scene, settling, also=also, found=found)


def _unsettled(scene: Scene, settling: SettlingTimes, *, also: str, found: Search | None) -> str:
    """Of runs that settle too seldom, by what explains them. Args: `also`: a change that is recommended."""
    share = (
        f"{settling.told(settling.settled.value)} settle within the time limit of "
        f"{scene.run.time_limit:.4g} s{also}: 95 % is not reached"
    )
    if settling.explained_by(settling.beyond_capacity):
        return (
            f"{share}; {settling.told(settling.beyond_capacity)} would need more moment than the disc "
            f"can form above its residual fill: {BEYOND_CAPACITY}"
        )
    if found is not None and found.needs is not None and found.needs_more_than(scene.run.time_limit):
        return f"{share}; they need some {found.needs:.2g} s: raise run.time_limit"
    if settling.explained_by(settling.beyond_pressure):
        return (
            f"{share}, nor by other gains; in {settling.told(settling.beyond_pressure)} the gas does not "
            f"drive the liquid far enough at {scene.gas.pressure / 1e6:.3g} MPa: raise gas.pressure"
        )
    if settling.explained_by(settling.drifted):
        return (
            f"{share}, nor by other gains and pressures; in {settling.told(settling.drifted)} the full tube "
            f"lets liquid run back while the gas is off: {RUNS_BACK}"
        )
    others = "" if found is None or found.settles else ", nor by other gains and pressures"
    return f"{share}{others}: {_ways_out(found)}"


def _ways_out(found: Search | None) -> str:
    """What lets 95 % of as many runs settle."""
    if found is None:
        return "raise controller.limit"
    ways = [
        text.format(value)
        for value, text in (
            (found.opening and 1e3 * found.opening, "lower controller.minimum_gas_time to {:.3g} ms"),
            (found.limit and 1e6 * found.limit, "raise controller.limit to {:.3g} um"),
            (found.valve, "take a valve and line {:.3g} times as fast"),
        )
        if value is not None
    ]
    if ways:
        return ", or ".join(ways)
    return (
        f"neither a limit {LIMITS[-1]:.3g} times as high nor a valve and line {VALVES[-1]:.3g} times as fast "
        "would do: state less uncertainty under [uncertainty] when the machine is known better"
    )
