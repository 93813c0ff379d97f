"""Order studies: observed order of each pair of levels, judged together with the finest error."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from skfem import Basis

from ringbalance.mesh.chamber import default_cells
from ringbalance.physics.pressure.solve import PressureSolution
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc
from ringbalance.verification.evidence import Convergence, Curve, Found, Series, figure

ROUND_OFF = 1e-13
"""Relative errors below this say nothing about the order."""


@dataclass(frozen=True, kw_only=True)
class OrderStudy:
    """Errors over a sequence of levels with the order that each pair of neighbours shows."""

    size: tuple[float, ...]
    """h, coarse to fine."""
    error: tuple[float, ...]
    """Magnitudes, of one scale for all levels."""
    order: tuple[float, ...]
    """Of each pair; shorter than the levels by one."""

    @classmethod
    def of(cls, *, size: Sequence[float], error: Sequence[float]) -> OrderStudy:
        """Observed orders p = ln(e_i/e_(i+1))/ln(h_i/h_(i+1)) of relative errors, coarse to fine.

        Raises: ValueError: lengths that differ, sizes that do not fall, errors that are negative, not finite
            or at round-off, where no order can be seen.
        """
        h, e = np.asarray(size, dtype=np.float64), np.asarray(error, dtype=np.float64)
        if h.shape != e.shape or h.size < 2:
            raise ValueError("an order study needs at least two levels, with one error each")
        if not (np.all(np.isfinite(h)) and np.all(h > 0) and np.all(np.diff(h) < 0)):
            raise ValueError("sizes must be positive and fall from level to level")
        if not (np.all(np.isfinite(e)) and np.all(e > ROUND_OFF)):
            raise ValueError("errors must be finite and above round-off for an order to be seen")
        order = np.log(e[:-1] / e[1:]) / np.log(h[:-1] / h[1:])
        return cls(size=tuple(h.tolist()), error=tuple(e.tolist()), order=tuple(order.tolist()))

    @property
    def finest_error(self) -> float:
        """Error on the finest level."""
        return self.error[-1]

    @property
    def settled_order(self) -> float:
        """The lowest order among the two finest pairs: earlier ones are not yet asymptotic."""
        return min(self.order[-2:])

    def table(self, quantity: str, formal_order: float, *, geometry: str = "", note: str = "") -> Convergence:
        """The errors, all relative, as a table beside the formal order."""
        return Convergence(
            quantity=quantity,
            unit="1",
            formal_order=formal_order,
            size=self.size,
            error=self.error,
            observed_order=self.order,
            geometry=geometry,
            note=note,
        )


def orders_found(studies: Mapping[str, OrderStudy]) -> dict[str, Found]:
    """The settled order and the finest error of each study as judged quantities, by its name."""
    orders = {f"{name}_order": Found(value=study.settled_order) for name, study in studies.items()}
    return orders | {f"{name}_error": Found(value=study.finest_error) for name, study in studies.items()}


def refined_cells(disc: Disc, levels: Sequence[int], *, dimension: int) -> list[tuple[int, ...]]:
    """Cells of a chamber's meshes, radial, angular and, in three dimensions, axial, for levels 1, 2, ..."""
    radial, share = (2, 4) if dimension == 2 else (1, 8)
    angular = default_cells(disc=disc)[1] // share
    return [(radial * n, angular * n, n)[:dimension] for n in levels]


def field_error(solution: PressureSolution, exact: Callable[[FloatArray], FloatArray]) -> float:
    """Root mean square over the liquid of a pressure's error, relative to that of the exact one at places."""
    chamber = solution.chamber
    # More points than the solve has, or its errors at these would be taken for all.
    basis = Basis(chamber.mesh, chamber.mesh.elem(), intorder=8)
    true = exact(chamber.length_scale * np.asarray(basis.global_coordinates()))
    difference = np.asarray(basis.interpolate(solution.pressure)) - true
    return float(np.sqrt(np.sum(basis.dx * difference**2) / np.sum(basis.dx * true**2)))


def order_figure(studies: Mapping[str, OrderStudy]) -> Series:
    """Errors of several studies on the same meshes, by the name of their curve."""
    size = next(iter(studies.values())).size
    curves = (Curve(name, "1", np.array(study.error)) for name, study in studies.items())
    return figure("error against mesh size", ("relative mesh size", "1", size), *curves, log=True)
