"""Rules of work for liquid, gas, controller and stated uncertainties."""

from __future__ import annotations

from collections.abc import Iterator

from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.fields import LETTERS
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.rules.check import Check, Finding, check, limit_above_noise, written
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES


def _liquid_stays_liquid(vapour: float, ambient: float) -> Finding | None:
    """Vapour pressure below ambient pressure, both absolute."""
    if vapour < ambient:
        return None
    limit = written(ambient, "kPa")
    return Finding(
        problem=f"the liquid boils: its vapour pressure reaches ambient_pressure ({limit})",
        allowed=f"at least 0 kPa and below {limit}, absolute",
    )


def _temperature_below_boiling(_temperature: float, vapour: float, ambient: float) -> Finding | None:
    """Vapour pressure at the given temperature below ambient pressure."""
    if vapour < ambient:
        return None
    return Finding(
        problem=f"the liquid boils: its vapour pressure at this temperature is {written(vapour, 'kPa')}",
        allowed=f"a temperature at which it is below ambient_pressure ({written(ambient, 'kPa')})",
    )


def _gas_times_in_order(minimum: float, maximum: float) -> Finding | None:
    if minimum < maximum:
        return None
    return Finding(
        problem=f"minimum_gas_time must be shorter than maximum_gas_time ({written(maximum, 's')})",
        allowed=f"at least 0 s and below {written(maximum, 's')}",
    )


def period_covers_lag(period: float, lag: float) -> Finding | None:
    """The sampling period is not shorter than the valve's lag."""
    if period >= lag:
        return None
    return Finding(
        problem=f"the next sample would be taken before the valve has moved (valve_lag {written(lag, 's')})",
        allowed=f"at least {written(lag, 's')}",
    )


def _trial_time_executed(step: float, minimum: float, maximum: float) -> Finding | None:
    """A valve-open time lies between the shortest and the longest that are executed."""
    if minimum <= step <= maximum:
        return None
    least = f"minimum_gas_time ({written(minimum, 's')})"
    return Finding(
        problem="a valve-open time of this length is never executed",
        allowed=f"from {least} to maximum_gas_time ({written(maximum, 's')})",
    )


def _steps_in_order(short: float, long: float) -> Finding | None:
    if short <= long:
        return None
    return Finding(
        problem=f"short_step must not be longer than long_step ({written(long, 's')})",
        allowed=f"above 0 s and at most {written(long, 's')}",
    )


def _sequence_complete(sequence: tuple[str, ...], chambers: int) -> Finding | None:
    """Every chamber stands in the sequence once."""
    letters = LETTERS[:chambers]
    if sorted(sequence) == list(letters):
        return None
    return Finding(
        problem=f"each of the {chambers} chambers must stand in it once",
        allowed=f"the letters {', '.join(letters)} in any order",
    )


def _one_for_each(offsets: tuple[float, ...] | None, chambers: int) -> Finding | None:
    """One time for all chambers, or one for each."""
    if offsets is None or len(offsets) in (1, chambers):
        return None
    return Finding(
        problem=f"a list of {len(offsets)} times for {chambers} chambers",
        allowed=f"one time for all, or a list of {chambers} in the order of the letters",
    )


_VAPOUR, _AMBIENT = "liquid.vapour_pressure", "gas.ambient_pressure"
_GAS_TIMES = ("controller.minimum_gas_time", "controller.maximum_gas_time")
_TRIAL_TIMES = ("controller.first_trial", "controller.long_step", "controller.short_step")


def _by_trial(reading: Reading) -> bool:
    return bool(reading.values.get("controller.kind") == "trial")


CHECKS: tuple[Check, ...] = (
    check(_liquid_stays_liquid, _VAPOUR, _AMBIENT, when=lambda reading: reading.given(_VAPOUR)),
    check(
        _temperature_below_boiling,
        "liquid.temperature",
        _VAPOUR,
        _AMBIENT,
        when=lambda reading: not reading.given(_VAPOUR),
    ),
    check(_gas_times_in_order, *_GAS_TIMES),
    check(period_covers_lag, "controller.period", "gas.valve_lag"),
    check(limit_above_noise("amplitude_noise", "um"), "controller.limit", "sensor.amplitude_noise"),
    *(
        check(_trial_time_executed, path, *_GAS_TIMES, when=_by_trial, moot=(_gas_times_in_order,))
        for path in _TRIAL_TIMES
    ),
    check(_steps_in_order, "controller.short_step", "controller.long_step", when=_by_trial),
    check(_sequence_complete, "controller.sequence", "disc.chambers"),
    check(_one_for_each, "controller.gas_time_offset", "disc.chambers"),
)


def uncertainty_faults(reading: Reading) -> Iterator[Fault]:
    """One error for each uncertainty of a quantity that the scene lacks, or that is larger than it."""
    for key, table in UNCERTAIN_QUANTITIES.items():
        path, quantity = f"uncertainty.{key}", f"{table}.{key}"
        if not reading.known(path):
            continue
        width, relative = reading.values[path]
        if quantity == "disc.plate_thickness" and quantity in reading.derived:
            problem = "the mesh has the plates in its shape, and no thickness of its own"
            yield reading.fault(path, problem=problem, allowed="central_angle's uncertainty in its place")
            continue
        if reading.lacks(quantity) and _may_be_unused(reading, quantity):
            problem = f"[{table}] has no {key} that could be uncertain"
            yield reading.fault(path, problem=problem, allowed=f"a scene with [{table}] {key}")
        elif (
            reading.known(quantity)
            and not relative
            and key != "lag_angle"
            and width > reading.values[quantity]
        ):
            problem = f"the uncertainty is larger than {key} itself"
            yield reading.fault(path, problem=problem, allowed="at most the quantity itself, or below 100 %")


def _may_be_unused(reading: Reading, path: str) -> bool:
    return reading.schema.key_at(tuple(path.split("."))).presence.kind == "unused"
