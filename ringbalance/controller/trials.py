"""Settings of a balancer to try, as levels on axes, and kinds of its drawn inputs.

A drawn input varies from device to device, or is one unknown value.  Where all devices have the same value, a
fraction of drawn devices is the probability that the design conforms (JCGM 106:2012, section 9), and not the
yield of a production.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Final

import numpy as np

from ringbalance.results.result import Facts
from ringbalance.results.rows import Finding, Quantity

Point = Mapping[str, float]
"""Level by name of the axis."""
Indices = tuple[float, ...]
"""Index of a level on each axis; a fraction between levels."""


@dataclass(frozen=True, kw_only=True)
class SearchAxis:
    """Axis of a search."""

    name: str
    """Name of the varied quantity, such as the path of a key."""
    levels: tuple[float, ...]
    """All levels that may be tried, increasing."""
    first: tuple[int, ...]
    """Indices of the levels that are tried first; the neighbours of the best follow."""
    unit: str = "1"
    """SI unit of the levels."""


@dataclass(frozen=True, kw_only=True)
class Trials:
    """Settings of one kind of controller."""

    kind: str
    axes: tuple[SearchAxis, ...]
    settings: Callable[[Point], Mapping[str, Any] | None]
    """Settings at a point by path, SI, rounded as in a scene file; None: there are none."""
    stated: bool = True
    """True if the scene states settings of its own that can be judged."""
    kind_stated: bool = True
    """True if the scene gives this kind, so that a merely faster one does not replace it."""
    scan_axis: SearchAxis | None = None
    """Axis, such as the supply's pressure, that is searched only where the others do not suffice, or on
    request, with a result at every level; a point without it is at the scene's level."""

    @property
    def first(self) -> list[Indices]:
        """Coarse grid of the levels that are tried first."""
        return list(product(*(axis.first for axis in self.axes)))

    def neighbours(self, indices: Indices, step: float = 1) -> list[Indices]:
        """Indices within the axes that are a step away on one axis."""
        return [
            (*indices[:axis], index + by, *indices[axis + 1 :])
            for axis, index in enumerate(indices)
            for by in (-step, step)
            if 0 <= index + by <= len(self.axes[axis].levels) - 1
        ]

    def at(self, indices: Indices, scan_level: float | None = None) -> Mapping[str, Any] | None:
        """Settings at levels, between them by interpolation; None: there are none.

        Args: `scan_level`: level on the scan axis; default the scene's.
        """
        pairs = zip(self.axes, indices, strict=True)
        point = {
            axis.name: float(np.interp(index, range(len(axis.levels)), axis.levels)) for axis, index in pairs
        }
        if scan_level is not None and self.scan_axis is not None:
            point[self.scan_axis.name] = scan_level
        return self.settings(point)


def rounded(value: float, digits: int = 3) -> float:
    """Value rounded to significant digits."""
    return float(f"{value:.{digits}g}")


MEASURE_INPUT: Final = "measure_input"


@dataclass(frozen=True, kw_only=True)
class DrawnInput:
    """Kind of a drawn input."""

    common: bool
    """True if all devices have the same unknown value; False if it varies between them."""
    measure: str
    """Code of the finding that says what to measure to know it better; empty: nothing can be measured."""
    path: str = ""
    """Path of its key in the scene; empty: the scene has none."""
    name: str = ""
    """Name under which related inputs are ranked together, such as both parts of a model's error; empty: the
    input's own."""


@dataclass(frozen=True, kw_only=True)
class Information:
    """Quantities of a loop that are known without a run; nothing is judged by them."""

    quantities: tuple[Quantity, ...] = ()
    facts: Facts = ()
    document: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
