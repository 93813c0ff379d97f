"""Every integrator on two laws with exact solutions: the paper's, and one without its parabola in time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.liquid_ring.integrators import closed_form, quadrature
from ringbalance.controller.liquid_ring.transfer import Drive, Integrator
from ringbalance.reduced_model.law.flow_law import Flow
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.scene.arrays import FloatArray
from ringbalance.verification.evidence import Table
from ringbalance.verification.reference.adaptive_ode import adaptive_ode
from ringbalance.verification.reference.explicit_segments import explicit_segments

_WAYS: Final[Mapping[str, Integrator]] = {
    "closed form": closed_form,
    "quadrature": quadrature,
    "adaptive, 1e-5": adaptive_ode(tolerance=1e-5),
    "adaptive, 1e-8": adaptive_ode(tolerance=1e-8),
    "adaptive, 1e-11": adaptive_ode(tolerance=1e-11),
    "Eq. 20, 16 segments": explicit_segments(16),
    "Eq. 20, 128 segments": explicit_segments(128),
    "Eq. 20, 1024 segments": explicit_segments(1024),
}


@dataclass(frozen=True, kw_only=True)
class TrialLaw:
    """What every such law has of the paper's."""

    name: str
    base: PaperLaw

    @property
    def max_fill_ratio(self) -> float:
        """Of the paper's law."""
        return self.base.max_fill_ratio

    def table(self) -> Mapping[str, FloatArray]:
        """Of the paper's law."""
        return self.base.table()


@dataclass(frozen=True, kw_only=True)
class SlowedLaw(TrialLaw):
    """The paper's law, slower in the share of its velocity that a function of the fill gives."""

    share: Callable[[FloatArray, float], FloatArray]
    """From x of the driven chamber and the largest x."""

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        """As the paper's law, slowed."""
        flow = self.base.evaluate(
            fill_ratio=fill_ratio,
            opposite_fill_ratio=opposite_fill_ratio,
            gas_pressure=gas_pressure,
            primed=primed,
        )
        share = self.share(np.asarray(fill_ratio, dtype=np.float64), self.max_fill_ratio)
        return replace(flow, velocity=flow.velocity * share)


def _tapered(fill_ratio: FloatArray, largest: float) -> FloatArray:
    """Smooth, and with an exact solution of its own."""
    return np.asarray((1 + fill_ratio / largest) / 2)


def _tapered_fill(drive: Drive, law: PaperLaw, time: FloatArray) -> FloatArray:
    """Exact fill under the tapered law, from a gas pressure that empties the chamber.

    With s = sqrt(alpha + beta x) and u = s (1 + x/x_max)/2 the fill obeys ds/dt = -(S/V) (A + D s^2)/2, so
    s = sqrt(A/D) tan(atan(s_0 sqrt(D/A)) - (S/V) sqrt(A D) t/2).
    """
    a, b = law.velocity_squared_per_pressure, law.pressure_per_fill_difference
    alpha, beta = a * (drive.gas_pressure - b * drive.total), 2 * a * b
    d = 0.5 / law.max_fill_ratio
    rest = beta / 2 - d * alpha
    start = math.atan(math.sqrt(alpha + beta * drive.fill) * math.sqrt(d / rest))
    s = math.sqrt(rest / d) * np.tan(start - drive.exchange_rate * math.sqrt(rest * d) / 2 * time)
    return np.asarray((s**2 - alpha) / beta, dtype=np.float64)


def tapered_error(drive: Drive, law: PaperLaw, time: FloatArray, way: Integrator) -> float:
    """Largest error in fill of an integrator under the tapered law."""
    found = way(replace(drive, law=SlowedLaw(name="tapered", base=law, share=_tapered)), time).fill
    return float(np.max(np.abs(found - _tapered_fill(drive, law, time))))


def side_by_side(drive: Drive, law: PaperLaw, duration: float) -> Table:
    """Error at the end of a long operation, and what it costs; the closed form is the reference."""
    t = np.array([duration])
    exact = float(closed_form(drive, t).fill[-1])
    rows = []
    for name, way in _WAYS.items():
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
