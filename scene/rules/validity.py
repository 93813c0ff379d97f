"""How far the program's physics holds: no disc turns faster, gas of one temperature, liquid of one density.

**Rim speed.** Turning stretches a thin ring by rho v^2, so its rim is no faster than (sigma/rho)^(1/2), its
strength over its density, and a solid disc's at most (8/(3 + nu))^(1/2) = 1.6 times that: 250 to 500 m/s in
steel, aluminium and titanium, 1 to 1.4 km/s in rings wound of carbon fibre alone, without chambers.  Above
1 km/s a scene is refused.

**Gas from the shaft to the liquid.**  With n = v^2/(2 R T) its pressure grows by exp(n) where heat comes and
goes, and by (1 + (1 - 1/gamma) n)^(gamma/(gamma - 1)) where none does: 0.8 % apart at n = 1/4, 11 % at n = 1,
a factor of 2.3 at n = 3.  The program takes the first, and refuses to above n = 1/4, 205 m/s at 20 degC.

**Density of the liquid.**  A pressure p makes it denser by p/K.  Up to 2 % the mean of a ring, in which the
pressure rises from the gas's to the wall's, is off by no more than a usual tolerance of 1 %.  A tube that no
more than p drives is no faster than (2 p/rho)^(1/2), so 2 % is also 0.2 of the speed of sound, (K/rho)^(1/2).
This is no refusal but a status of what is calculated, `reduced_model.chamber.contributions`.
"""

from __future__ import annotations

import math
from typing import Final

from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.models import Liquid
from ringbalance.scene.rules.check import Check, Finding, check, written

LARGEST_RIM_SPEED: Final = 1000.0
"""m/s."""
AIR_CONSTANT: Final = 287.05
"""R of dry air, J/(kg K)."""
LARGEST_EXPONENT: Final = 0.25
"""n of a gas column."""
LARGEST_COMPRESSION: Final = 0.02
"""p/K."""
METAL_DENSITY: Final = 3000.0
"""kg/m^3; what is denser is taken for a liquid metal."""
_WATER, _METAL, _OTHER = 2.0e9, 25e9, 0.8e9
_ROUNDED: Final = 1 - 5e-4
"""Less than four digits may be rounded up by."""


def bulk_modulus(liquid: Liquid) -> float:
    """K, Pa, on the safe side: of water, of a liquid metal, or of any other liquid.

    Source: water from 0 to 100 degC 1.96 to 2.29 GPa, Wagner and Pruss, J. Phys. Chem. Ref. Data 31 (2002)
        387 (IAPWS-95); mercury 25 GPa, gallium more; silicone and perfluorinated oils, the softest that are
        in use, 0.8 to 1 GPa by their speeds of sound, recalled and not read.
    """
    if liquid.density > METAL_DENSITY:
        return _METAL
    return _WATER if liquid.name.casefold() == "water" else _OTHER


def _rim_holds(speed: float, outer: float) -> Finding | None:
    """omega R2 <= 1 km/s."""
    if speed * outer <= LARGEST_RIM_SPEED:
        return None
    return Finding(
        problem=f"the rim would move at {speed * outer:.4g} m/s, which no disc withstands",
        allowed=f"above 0 rpm and at most {_rpm(LARGEST_RIM_SPEED / outer)}, {LARGEST_RIM_SPEED:g} m/s at "
        f"outer_radius ({written(outer, 'mm')})",
    )


def _gas_column_holds(speed: float, outer: float, temperature: float) -> Finding | None:
    """(omega R2)^2 <= R T/2."""
    fastest = math.sqrt(2 * LARGEST_EXPONENT * AIR_CONSTANT * temperature)
    if speed * outer <= fastest:
        return None
    return Finding(
        problem=f"the rim would move at {speed * outer:.4g} m/s, too fast to know the gas pressure on the "
        'liquid from one on the shaft (gas.measured_at = "shaft")',
        allowed=f"at most {_rpm(fastest / outer)}, {fastest:.3g} m/s at outer_radius with this "
        'gas.temperature; or gas.measured_at = "chamber"',
    )


def _rpm(speed: float) -> str:
    return f"{_ROUNDED * speed * 30 / math.pi:.4g} rpm"


def _on_shaft(reading: Reading) -> bool:
    return bool(reading.values.get("gas.measured_at") == "shaft")


_RIM: Final = ("rotor.speed", "disc.outer_radius")
CHECKS: Final[tuple[Check, ...]] = (
    check(_rim_holds, *_RIM),
    check(_gas_column_holds, *_RIM, "gas.temperature", when=_on_shaft, moot=(_rim_holds,)),
)
