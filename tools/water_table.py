"""Water at atmospheric pressure as Chebyshev series, from `chemicals`, which the program does not need."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from chemicals.iapws import iapws95_Psat, iapws95_rho
from chemicals.viscosity import mu_IAPWS
from numpy.polynomial import chebyshev

COLDEST_WATER_K, HOTTEST_WATER_K, PRESSURE, DEGREE = 273.15, 373.05, 101325.0, 20
TARGET = Path(__file__).resolve().parent.parent / "ringbalance" / "scene" / "data" / "water.csv"
HEAD = """\
# Water at 101325 Pa, 273.15 to 373.05 K: coefficients of Chebyshev series in x = 2 (T - 273.15) / 99.9 - 1.
# Density and vapour pressure: IAPWS-95, Wagner and Pruss, J. Phys. Chem. Ref. Data 31 (2002) 387;
# viscosity: IAPWS 2008, Huber et al., ibid. 38 (2009) 101. The series repeat them within 1e-11.
# Made by tools/water_table.py (package chemicals 1.5.2); SHA-256 of the rest: {digest}
"""


def table() -> str:
    """Series of density, kg/m^3; logarithm of kinematic viscosity, m^2/s; that of vapour pressure, Pa."""
    x = np.cos(np.pi * (np.arange(2 * DEGREE) + 0.5) / (2 * DEGREE))
    temperature = COLDEST_WATER_K + (HOTTEST_WATER_K - COLDEST_WATER_K) * (x + 1) / 2
    density = np.array([iapws95_rho(t, PRESSURE) for t in temperature])
    viscosity = np.array([mu_IAPWS(t, rho) for t, rho in zip(temperature, density, strict=True)]) / density
    vapour_pressure = np.array([iapws95_Psat(t) for t in temperature])
    series = [chebyshev.chebfit(x, v, DEGREE) for v in (density, np.log(viscosity), np.log(vapour_pressure))]
    rows = ["density,log_kinematic_viscosity,log_vapour_pressure"]
    rows += [",".join(f"{value:.15e}" for value in row) for row in zip(*series, strict=True)]
    return "\n".join(rows) + "\n"


def files(_: Sequence[str]) -> Iterator[tuple[Path, bytes]]:
    """Path and bytes of the series, with their digest."""
    body = table()
    yield TARGET, (HEAD.format(digest=hashlib.sha256(body.encode()).hexdigest()) + body).encode()
