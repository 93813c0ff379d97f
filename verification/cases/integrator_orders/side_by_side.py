"""Every integrator on two laws with exact solutions: the paper's, and one without its parabola in time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.closed_form import closed_form
from ringbalance.controller.liquid_ring.quadrature import quadrature
from ringbalance.controller.liquid_ring.transfer import Drive, Integrator
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.cases.integrator_orders.slowed_law import SlowedLaw
from ringbalance.verification.evidence import Table
from ringbalance.verification.reference.adaptive_ode import adaptive_ode
from ringbalance.verification.reference.explicit_segments import explicit_segments

WAYS: Final[Mapping[str, Integrator]] = {
    "closed form": closed_form,
    "quadrature": quadrature,
    "adaptive, 1e-5": adaptive_ode(tolerance=1e-5),
    "adaptive, 1e-8": adaptive_ode(tolerance=1e-8),
    "adaptive, 1e-11": adaptive_ode(tolerance=1e-11),
    "Eq. 20, 16 segments": explicit_segments(16),
    "Eq. 20, 128 segments": explicit_segments(128),
    "Eq. 20, 1024 segments": explicit_segments(1024),
}


def _tapered(fill_ratio: FloatArray, largest: float) -> FloatArray:
    """Smooth, and with an exact solution of its own."""
    return np.asarray((1 + fill_ratio / largest) / 2)


def tapered_fill(drive: Drive, law: PaperLaw, time: FloatArray) -> FloatArray:
    """Exact fill under the tapered law, from a gas pressure that empties the chamber.

    With s = sqrt(alpha + beta x) and u = s (1 + x/x_max)/2 the fill obeys ds/dt = -(S/V) (A + D s^2)/2, so
    s = sqrt(A/D) tan(atan(s_0 sqrt(D/A)) - (S/V) sqrt(A D) t/2).
    Args: `drive`: from a fill at which liquid flows. `law`: the paper's law. `time`: s, any shape.
    Returns: x, of that shape.
    """
    a, b = law.velocity_squared_per_pressure, law.pressure_per_fill_difference
    alpha, beta = a * (drive.gas_pressure - b * drive.total), 2 * a * b
    d = 0.5 / law.max_fill_ratio
    rest = beta / 2 - d * alpha
    start = math.atan(math.sqrt(alpha + beta * drive.fill) * math.sqrt(d / rest))
    s = math.sqrt(rest / d) * np.tan(start - drive.exchange_rate * math.sqrt(rest * d) / 2 * time)
    return np.asarray((s**2 - alpha) / beta, dtype=np.float64)


def tapered_error(drive: Drive, law: PaperLaw, time: FloatArray, way: Integrator) -> float:
    """Largest error of an integrator under the tapered law.

    Args: `drive`: under the paper's law. `law`: the paper's law. `time`: s, ascending.
    Returns: In fill.
    """
    found = way(replace(drive, law=SlowedLaw(name="tapered", base=law, share=_tapered)), time).fill
    return float(np.max(np.abs(found - tapered_fill(drive, law, time))))


def side_by_side(drive: Drive, law: PaperLaw, duration: float) -> Table:
    """Error at the end of a long operation, and what it costs, for every integrator.

    Args: `drive`: under the paper's law. `law`: the paper's law. `duration`: s.
    Returns: Table; the closed form has no row for the tapered law, and its own is the reference.
    """
    t = np.array([duration])
    exact = float(closed_form(drive, t).fill[-1])
    rows = []
    for name, way in WAYS.items():
        done, count = way(drive, t), _velocities_taken(drive, law, t, way)
        tapered = math.nan if way is closed_form else tapered_error(drive, law, t, way)
        error = abs(float(done.fill[-1]) - exact)
        rows.append((name, _number(error), _number(tapered), count))
    columns = ("integrator", "error, paper's law", "error, tapered law", "velocities taken")
    return Table(
        name="integrators side by side: error in fill at the end of a long operation",
        columns={name: [row[i] for row in rows] for i, name in enumerate(columns)},
    )


def _velocities_taken(drive: Drive, law: PaperLaw, time: FloatArray, way: Integrator) -> str:
    """At how many points an integrator asks the law, its table included where it makes one."""
    if way is closed_form:
        return "none"
    sizes: list[int] = []

    def count(fill_ratio: FloatArray, _: float) -> FloatArray:
        sizes.append(fill_ratio.size)
        return np.ones_like(fill_ratio)

    way(replace(drive, law=SlowedLaw(name="counted", base=law, share=count)), time)
    return f"{sum(sizes)}"


def _number(error: float) -> str:
    if math.isnan(error):
        return "does not apply"
    return f"{error:.1e}" if error > np.finfo(np.float64).eps else "round-off"
