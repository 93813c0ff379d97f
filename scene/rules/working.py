"""Rules of work for liquid, gas and controller: each takes SI values and says what is wrong, or None."""

from __future__ import annotations

from ringbalance.scene.keys.fields import LETTERS
from ringbalance.scene.rules.finding import Finding, kilopascal, seconds, um


def liquid_stays_liquid(vapour: float, ambient: float) -> Finding | None:
    """Vapour pressure below ambient pressure.

    Args: `vapour`: Pa, absolute. `ambient`: Pa, absolute.
    Returns: None when it holds.
    """
    if vapour < ambient:
        return None
    return Finding(
        problem=f"the liquid boils: its vapour pressure reaches ambient_pressure ({kilopascal(ambient)})",
        allowed=f"at least 0 kPa and below {kilopascal(ambient)}, absolute",
    )


def temperature_below_boiling(_temperature: float, vapour: float, ambient: float) -> Finding | None:
    """Vapour pressure at the given temperature below ambient pressure.

    Args: `_temperature`: K. `vapour`: Pa, absolute. `ambient`: Pa, absolute.
    Returns: None when it holds.
    """
    if vapour < ambient:
        return None
    return Finding(
        problem=f"the liquid boils: its vapour pressure at this temperature is {kilopascal(vapour)}",
        allowed=f"a temperature at which it is below ambient_pressure ({kilopascal(ambient)})",
    )


def gas_times_in_order(minimum: float, maximum: float) -> Finding | None:
    """Minimum below maximum.

    Args: `minimum`: s. `maximum`: s.
    Returns: None when it holds.
    """
    if minimum < maximum:
        return None
    return Finding(
        problem=f"minimum_gas_time must be shorter than maximum_gas_time ({seconds(maximum)})",
        allowed=f"at least 0 s and below {seconds(maximum)}",
    )


def period_covers_lag(period: float, lag: float) -> Finding | None:
    """The sampling period is not shorter than the valve's lag. Returns: None when it holds."""
    if period >= lag:
        return None
    return Finding(
        problem=f"the next sample would be taken before the valve has moved (valve_lag {seconds(lag)})",
        allowed=f"at least {seconds(lag)}",
    )


def limit_above_noise(limit: float, noise: float) -> Finding | None:
    """The limit is above the standard deviation of the measured amplitude.

    Args: `limit`: m. `noise`: m.
    Returns: None when it holds.
    """
    if limit > noise:
        return None
    return Finding(
        problem=f"the limit is below the sensor noise (amplitude_noise {um(noise)})",
        allowed=f"above {um(noise)}",
    )


def trial_time_executed(step: float, minimum: float, maximum: float) -> Finding | None:
    """A valve-open time lies between the shortest and the longest that are executed.

    Args: `step`: s. `minimum`: s. `maximum`: s.
    Returns: None when it holds.
    """
    if minimum <= step <= maximum:
        return None
    return Finding(
        problem="a valve-open time of this length is never executed",
        allowed=f"from minimum_gas_time ({seconds(minimum)}) to maximum_gas_time ({seconds(maximum)})",
    )


def steps_in_order(short: float, long: float) -> Finding | None:
    """The short step is not longer than the long one.

    Args: `short`: s. `long`: s.
    Returns: None when it holds.
    """
    if short <= long:
        return None
    return Finding(
        problem=f"short_step must not be longer than long_step ({seconds(long)})",
        allowed=f"above 0 s and at most {seconds(long)}",
    )


def sequence_complete(sequence: tuple[str, ...], chambers: int) -> Finding | None:
    """Every chamber stands in the sequence once.

    Args: `sequence`: letters. `chambers`: number of chambers.
    Returns: None when it holds.
    """
    letters = LETTERS[:chambers]
    if sorted(sequence) == list(letters):
        return None
    return Finding(
        problem=f"each of the {chambers} chambers must stand in it once",
        allowed=f"the letters {', '.join(letters)} in any order",
    )
