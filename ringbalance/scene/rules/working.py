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
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.faults import Fault
from ringbalance.scene.keys.fields import LETTERS
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.kinds import Check, condition, limit_above_noise
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


def _fastest(values: Any, limit: float) -> dict[str, Any]:
    """Velocity of the rim, m/s, its limit, and the speed at that limit."""
    outer = values.outer_radius
    fastest = f"{_ROUNDED * limit / outer * 30 / math.pi:.4g} rpm"
    return {"rim": values.speed * outer, "most": limit, "fastest": fastest}


def _letters(values: Any) -> dict[str, Any]:
    letters = LETTERS[: values.chambers]
    return {"letters": letters, "listed": ", ".join(letters)}


def _executed(key: str, values: Any) -> bool:
    return bool(values.minimum_gas_time <= getattr(values, key) <= values.maximum_gas_time)


def _by_trial(reading: SceneReading) -> bool:
    return bool(reading.values.get("controller.kind") == "trial")


_RIM: Final = ("rotor.speed", "disc.outer_radius")
_VAPOUR, _AMBIENT = "liquid.vapour_pressure", "gas.ambient_pressure"
_GAS_TIMES = ("controller.minimum_gas_time", "controller.maximum_gas_time")
_TRIAL_TIMES = ("first_trial", "long_step", "short_step")


CHECKS: tuple[Check, ...] = (
    condition(
        "liquid_stays_liquid",
        *(_VAPOUR, _AMBIENT),
        holds=lambda v: v.vapour_pressure < v.ambient_pressure,
        problem="the liquid boils: its vapour pressure reaches ambient_pressure ({ambient_pressure:kPa})",
        allowed="at least 0 kPa and below {ambient_pressure:kPa}, absolute",
        when=lambda reading: reading.given(_VAPOUR),
    ),
    condition(
        "temperature_below_boiling",
        *("liquid.temperature", _VAPOUR, _AMBIENT),
        holds=lambda v: v.vapour_pressure < v.ambient_pressure,
        problem="the liquid boils: its vapour pressure at this temperature is {vapour_pressure:kPa}",
        allowed="a temperature at which it is below ambient_pressure ({ambient_pressure:kPa})",
        when=lambda reading: not reading.given(_VAPOUR),
    ),
    condition(
        "gas_times_in_order",
        *_GAS_TIMES,
        holds=lambda v: v.minimum_gas_time < v.maximum_gas_time,
        problem="minimum_gas_time must be shorter than maximum_gas_time ({maximum_gas_time:s})",
        allowed="at least 0 s and below {maximum_gas_time:s}",
    ),
    condition(
        "period_covers_lag",
        *("controller.period", "gas.valve_lag"),
        holds=lambda v: v.period >= v.valve_lag,
        problem="the next sample would be taken before the valve has moved (valve_lag {valve_lag:s})",
        allowed="at least {valve_lag:s}; a valve_lag that [gas] does not state is assumed",
    ),
    limit_above_noise("controller.limit", "sensor.amplitude_noise", "um"),
    *(
        condition(
            "trial_time_executed",
            *(f"controller.{key}", *_GAS_TIMES),
            holds=partial(_executed, key),
            problem="a valve-open time of this length is never executed",
            allowed="from minimum_gas_time ({minimum_gas_time:s}) to maximum_gas_time ({maximum_gas_time:s})",
            when=_by_trial,
            moot=("gas_times_in_order",),
        )
        for key in _TRIAL_TIMES
    ),
    condition(
        "steps_in_order",
        *("controller.short_step", "controller.long_step"),
        holds=lambda v: v.short_step <= v.long_step,
        problem="short_step must not be longer than long_step ({long_step:s})",
        allowed="above 0 s and at most {long_step:s}",
        when=_by_trial,
    ),
    condition(
        "sequence_complete",
        *("controller.sequence", "disc.chambers"),
        more=_letters,
        holds=lambda v: sorted(v.sequence) == list(v.letters),
        problem="each of the {chambers} chambers must stand in it once",
        allowed="the letters {listed} in any order",
    ),
    condition(
        "one_for_each",
        *("controller.gas_time_offset", "disc.chambers"),
        more=lambda v: {"count": len(v.gas_time_offset or (0.0,))},
        holds=lambda v: v.count in (1, v.chambers),
        problem="a list of {count} times for {chambers} chambers",
        allowed="one time for all, or a list of {chambers} in the order of the letters",
    ),
    condition(
        "rim_holds",
        *_RIM,
        more=lambda v: _fastest(v, _LARGEST_RIM_SPEED_M_S),
        holds=lambda v: v.rim <= v.most,
        problem="the rim would move at {rim:.4g} m/s, which no disc withstands",
        allowed="above 0 rpm and at most {fastest}, {most:g} m/s at outer_radius ({outer_radius:mm})",
    ),
    condition(
        "gas_column_holds",
        *(*_RIM, "gas.temperature"),
        # The largest omega R2 of a gas column is (R T/2)^(1/2).
        more=lambda v: _fastest(v, math.sqrt(2 * _LARGEST_EXPONENT * AIR_CONSTANT * v.temperature)),
        holds=lambda v: v.rim <= v.most,
        problem="the rim would move at {rim:.4g} m/s, too fast to know the gas pressure on the liquid from "
        'one on the shaft (gas.measured_at = "shaft")',
        allowed="at most {fastest}, {most:.3g} m/s at outer_radius with this gas.temperature; or "
        'gas.measured_at = "chamber"',
        when=lambda reading: reading.values.get("gas.measured_at") == "shaft",
        moot=("rim_holds",),
    ),
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
