"""Rules for liquid, gas, controller and uncertainties, and limits of validity of the program's physics.

The limits concern the strength of discs, gas of one temperature and liquid of one density:

**Rim speed.** Turning stretches a thin ring by rho v^2, so its rim is no faster than (sigma/rho)^(1/2), its
strength over its density, and a solid disc's at most (8/(3 + nu))^(1/2) = 1.6 times that: 250 to 500 m/s in
steel, aluminium and titanium, 1 to 1.4 km/s in rings wound of carbon fibre alone, without chambers.  Above
1 km/s a scene is refused.

**Gas from the shaft to the liquid.**  With n = v^2/(2 R T) its pressure grows by exp(n) where heat comes and
goes, and by (1 + (1 - 1/gamma) n)^(gamma/(gamma - 1)) where none does: 0.8 % apart at n = 1/4, 11 % at n = 1,
a factor of 2.3 at n = 3.  The program takes the first, and refuses scenes above n = 1/4, 205 m/s at 20 degC.

**Density of the liquid.**  A pressure p makes it denser by p/K.  Up to 2 % the mean of a ring, in which the
pressure rises from the gas's to the wall's, is off by no more than a usual tolerance of 1 %.  A tube that no
more than p drives is no faster than (2 p/rho)^(1/2), so 2 % is also 0.2 of the speed of sound, (K/rho)^(1/2).
Beyond, a scene is not refused; its results get a status, see `reduced_model.chamber.contributions`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.fields import LETTERS
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.kinds import Check, Contradiction, check, limit_above_noise, written
from ringbalance.scene.models import Liquid
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES

_LARGEST_RIM_SPEED_M_S: Final = 1000.0
AIR_CONSTANT: Final = 287.05
"""R of dry air, J/(kg K)."""
_LARGEST_EXPONENT: Final = 0.25
"""Largest exponent n of a gas column."""
LARGEST_COMPRESSION: Final = 0.02
"""Largest compression p/K of the liquid."""
METAL_DENSITY_KG_M3: Final = 3000.0
"""Density above which a liquid is taken for a liquid metal, kg/m^3."""
_WATER, _METAL, _OTHER = 2.0e9, 25e9, 0.8e9
_WATER_TENSION_N_M, _METAL_TENSION_N_M = 0.073, 0.72
_ROUNDED: Final = 1 - 5e-4
"""Factor that covers the rounding of a number to four digits."""


def bulk_modulus(liquid: Liquid) -> float:
    """Bulk modulus K, Pa, a lower bound: of water, of a liquid metal, or of any other liquid.

    Source: water from 0 to 100 degC 1.96 to 2.29 GPa, Wagner and Pruss, J. Phys. Chem. Ref. Data 31 (2002)
        387 (IAPWS-95); mercury 25 GPa, gallium more; silicone and perfluorinated oils, the softest
        in use, 0.8 to 1 GPa by their speeds of sound, recalled and not read.
    """
    if liquid.density > METAL_DENSITY_KG_M3:
        return _METAL
    return _WATER if liquid.name.casefold() == "water" else _OTHER


def surface_tension(liquid: Liquid) -> FloatArray:
    """Surface tension sigma, N/m, an upper bound: of water at 20 degC, or of gallium for a liquid metal.

    Source: IAPWS R1-76(2014); `data/fluid_properties.csv`.
    """
    return np.where(np.greater(liquid.density, METAL_DENSITY_KG_M3), _METAL_TENSION_N_M, _WATER_TENSION_N_M)


def _rim_holds(speed: float, outer: float) -> Contradiction | None:
    """omega R2 <= 1 km/s."""
    if speed * outer <= _LARGEST_RIM_SPEED_M_S:
        return None
    return Contradiction(
        problem=f"the rim would move at {speed * outer:.4g} m/s, which no disc withstands",
        allowed=f"above 0 rpm and at most {_rpm(_LARGEST_RIM_SPEED_M_S / outer)}, "
        f"{_LARGEST_RIM_SPEED_M_S:g} m/s at outer_radius ({written(outer, 'mm')})",
    )


def _gas_column_holds(speed: float, outer: float, temperature: float) -> Contradiction | None:
    """(omega R2)^2 <= R T/2."""
    fastest = math.sqrt(2 * _LARGEST_EXPONENT * AIR_CONSTANT * temperature)
    if speed * outer <= fastest:
        return None
    return Contradiction(
        problem=f"the rim would move at {speed * outer:.4g} m/s, too fast to know the gas pressure on the "
        'liquid from one on the shaft (gas.measured_at = "shaft")',
        allowed=f"at most {_rpm(fastest / outer)}, {fastest:.3g} m/s at outer_radius with this "
        'gas.temperature; or gas.measured_at = "chamber"',
    )


def _rpm(speed: float) -> str:
    return f"{_ROUNDED * speed * 30 / math.pi:.4g} rpm"


def _on_shaft(reading: SceneReading) -> bool:
    return bool(reading.values.get("gas.measured_at") == "shaft")


def _liquid_stays_liquid(vapour: float, ambient: float) -> Contradiction | None:
    """Vapour pressure below ambient pressure, both absolute."""
    if vapour < ambient:
        return None
    limit = written(ambient, "kPa")
    return Contradiction(
        problem=f"the liquid boils: its vapour pressure reaches ambient_pressure ({limit})",
        allowed=f"at least 0 kPa and below {limit}, absolute",
    )


def _temperature_below_boiling(_temperature: float, vapour: float, ambient: float) -> Contradiction | None:
    """Vapour pressure at the given temperature below ambient pressure."""
    if vapour < ambient:
        return None
    return Contradiction(
        problem=f"the liquid boils: its vapour pressure at this temperature is {written(vapour, 'kPa')}",
        allowed=f"a temperature at which it is below ambient_pressure ({written(ambient, 'kPa')})",
    )


def _gas_times_in_order(minimum: float, maximum: float) -> Contradiction | None:
    if minimum < maximum:
        return None
    return Contradiction(
        problem=f"minimum_gas_time must be shorter than maximum_gas_time ({written(maximum, 's')})",
        allowed=f"at least 0 s and below {written(maximum, 's')}",
    )


def _period_covers_lag(period: float, lag: float) -> Contradiction | None:
    """The sampling period is not shorter than the valve's lag."""
    if period >= lag:
        return None
    return Contradiction(
        problem=f"the next sample would be taken before the valve has moved (valve_lag {written(lag, 's')})",
        allowed=f"at least {written(lag, 's')}",
    )


def _trial_time_executed(step: float, minimum: float, maximum: float) -> Contradiction | None:
    """A valve-open time lies between the shortest and the longest that the valve executes."""
    if minimum <= step <= maximum:
        return None
    least = f"minimum_gas_time ({written(minimum, 's')})"
    return Contradiction(
        problem="a valve-open time of this length is never executed",
        allowed=f"from {least} to maximum_gas_time ({written(maximum, 's')})",
    )


def _steps_in_order(short: float, long: float) -> Contradiction | None:
    if short <= long:
        return None
    return Contradiction(
        problem=f"short_step must not be longer than long_step ({written(long, 's')})",
        allowed=f"above 0 s and at most {written(long, 's')}",
    )


def _sequence_complete(sequence: tuple[str, ...], chambers: int) -> Contradiction | None:
    """The sequence has every chamber once."""
    letters = LETTERS[:chambers]
    if sorted(sequence) == list(letters):
        return None
    return Contradiction(
        problem=f"each of the {chambers} chambers must stand in it once",
        allowed=f"the letters {', '.join(letters)} in any order",
    )


def _one_for_each(offsets: tuple[float, ...] | None, chambers: int) -> Contradiction | None:
    """One time for all chambers, or one for each."""
    if offsets is None or len(offsets) in (1, chambers):
        return None
    return Contradiction(
        problem=f"a list of {len(offsets)} times for {chambers} chambers",
        allowed=f"one time for all, or a list of {chambers} in the order of the letters",
    )


_RIM: Final = ("rotor.speed", "disc.outer_radius")
_VAPOUR, _AMBIENT = "liquid.vapour_pressure", "gas.ambient_pressure"
_GAS_TIMES = ("controller.minimum_gas_time", "controller.maximum_gas_time")
_TRIAL_TIMES = ("controller.first_trial", "controller.long_step", "controller.short_step")


def _by_trial(reading: SceneReading) -> bool:
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
    check(_period_covers_lag, "controller.period", "gas.valve_lag"),
    check(limit_above_noise("amplitude_noise", "um"), "controller.limit", "sensor.amplitude_noise"),
    *(
        check(_trial_time_executed, path, *_GAS_TIMES, when=_by_trial, moot=(_gas_times_in_order,))
        for path in _TRIAL_TIMES
    ),
    check(_steps_in_order, "controller.short_step", "controller.long_step", when=_by_trial),
    check(_sequence_complete, "controller.sequence", "disc.chambers"),
    check(_one_for_each, "controller.gas_time_offset", "disc.chambers"),
    check(_rim_holds, *_RIM),
    check(_gas_column_holds, *_RIM, "gas.temperature", when=_on_shaft, moot=(_rim_holds,)),
)


def uncertainty_faults(reading: SceneReading) -> Iterator[Fault]:
    """One error for each uncertainty of a quantity that the scene lacks, or larger than the quantity."""
    for path in reading.tables["uncertainty"].values:
        key = path.removeprefix("uncertainty.")
        if key not in UNCERTAIN_QUANTITIES or not reading.known(path):
            continue
        table = UNCERTAIN_QUANTITIES[key]
        quantity, (width, relative) = f"{table}.{key}", reading.values[path]
        if quantity == "disc.plate_thickness" and quantity in reading.derived:
            problem = "the mesh has the plates in its shape, and no thickness of its own"
            yield reading.fault(path, problem=problem, allowed="central_angle's uncertainty in its place")
            continue
        presence = reading.schema.tables[table].keys[key].presence
        if reading.lacks(quantity) and presence.kind == "unused":
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
