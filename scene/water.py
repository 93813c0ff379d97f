"""Water from the property library; the one place that imports it, for the library is slow to load."""

from __future__ import annotations

from chemicals.iapws import iapws95_Psat, iapws95_rho
from chemicals.viscosity import mu_IAPWS

COLDEST = 273.15
"""K; water freezes below."""
HOTTEST = 373.05
"""K (99.9 degC); water boils at atmospheric pressure just above."""
_ATMOSPHERIC_PRESSURE = 101325.0


def water_properties(*, temperature: float) -> tuple[float, float, float]:
    """Properties of water at atmospheric pressure.

    Args: `temperature`: K.
    Returns: Density, kg/m^3; kinematic viscosity, m^2/s; vapour pressure, Pa absolute.
    Raises: ValueError: a temperature at which water is not liquid.
    Range: `COLDEST` to `HOTTEST`, 101 325 Pa; at 10 MPa the density is 0.5 % higher, which is left out.
    Source: density and vapour pressure, Wagner and Pruss, J. Phys. Chem. Ref. Data 31 (2002) 387 (IAPWS-95);
        viscosity, Huber et al., J. Phys. Chem. Ref. Data 38 (2009) 101 (IAPWS 2008); package `chemicals`.
    """
    if not COLDEST <= temperature <= HOTTEST:
        raise ValueError(f"temperature must lie within {COLDEST} K and {HOTTEST} K")
    density = float(iapws95_rho(temperature, _ATMOSPHERIC_PRESSURE))  # type: ignore[no-untyped-call]
    viscosity = float(mu_IAPWS(temperature, density))
    vapour_pressure = float(iapws95_Psat(temperature))  # type: ignore[no-untyped-call]
    return density, viscosity / density, vapour_pressure
