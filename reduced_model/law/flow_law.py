"""Interface of every flow law, and its arguments, checked and broadcast.

A law's file is JSON: records by their type and field names, floats by their shortest exact decimals.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray, IntArray, clipped
from ringbalance.scene.origins import summary_text
from ringbalance.scene.platform.files import write_whole
from ringbalance.scene.units import plain_number

CALIBRATED: Final = "calibrated"
"""Name of the law that `calibrate` makes, the default."""
UNCHECKED: Final = "calibrated, unchecked"
"""Name of a calibrated law without finite elements and uncertain inputs, for runs of many designs."""
FILL_SLACK: Final = 1e-9
"""Fill ratios this far outside the range are taken as its end: integrators land there by round-off."""


class Regime(IntEnum):
    """Regime of the flow in the connecting tube.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> flow = rb.paper_law(scene).evaluate(fill_ratio=0.25, gas_pressure=0.0)
        >>> rb.Regime(int(flow.regime)).name
        'BLOCKED'
    """

    BLOCKED = 0
    SIPHON = 1
    SEPARATED = 2
    REVERSE = 3
    UNDECIDED = 4
    """Siphon or separated: the uncertainty of the pressure over the crest allows both."""

    @property
    def label(self) -> str:
        """Lower-case name, as in JSON."""
        return self.name.lower()


@dataclass(frozen=True, kw_only=True)
class Flow:
    """State of the tube for arrays of conditions, all of one shape.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> flow: rb.Flow = rb.calibrate(scene).flow_law.evaluate(fill_ratio=[0.1, 0.4], gas_pressure=0.7e6)
        >>> flow.velocity.round(1).tolist()
        [12.3, 17.2]
    """

    velocity: FloatArray
    """Mean velocity, m/s, positive out of the driven chamber; zero where blocked."""
    regime: IntArray
    """Values of `Regime`."""
    uncertainty: FloatArray
    """Expanded uncertainty (95 %) of the velocity, m/s."""
    primed: BoolArray
    """True if the tube holds a continuous column afterwards."""


class FlowLaw(Protocol):
    """Velocity in the connecting tube; arrays in, arrays out, SI.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> law: rb.FlowLaw = rb.paper_law(scene)
        >>> law.evaluate(fill_ratio=[0.1, 0.4], gas_pressure=0.7e6).velocity.shape
        (2,)
    """

    @property
    def name(self) -> str:
        """Short name for results: "paper", "calibrated", ..."""
        ...

    @property
    def max_fill_ratio(self) -> float:
        """Liquid of the pair as a fraction of one chamber's volume."""
        ...

    def evaluate(
        self,
        *,
        fill_ratio: npt.ArrayLike,
        opposite_fill_ratio: npt.ArrayLike | None = None,
        gas_pressure: npt.ArrayLike,
        primed: npt.ArrayLike = False,
    ) -> Flow:
        """Flow for a driven chamber's fill ratio and gauge gas pressure.

        Arguments may be quantities with units, such as those of pint.
        Args:
            fill_ratio: x of the driven chamber, any shape, within [0, max_fill_ratio].
            opposite_fill_ratio: of the opposite chamber; default max_fill_ratio - fill_ratio.
            gas_pressure: gauge, Pa, in the driven chamber; the opposite one is vented.
            primed: whether the tube holds a continuous column beforehand.
        Returns: Flow, of the broadcast shape of the arguments.
        Raises: ValueError: a fill ratio outside the range, a NaN, or a negative absolute pressure.
        """
        ...


Conditions = tuple[FloatArray, FloatArray, FloatArray, BoolArray]
"""Fill ratios of the driven and of the opposite chamber, gauge pressure in the driven one, Pa, and true where
the tube holds a continuous column beforehand; arrays of one shape."""


def checked_conditions(
    law: Any,
    fill_ratio: npt.ArrayLike,
    opposite_fill_ratio: npt.ArrayLike | None,
    gas_pressure: npt.ArrayLike,
    primed: npt.ArrayLike,
) -> Conditions:
    """Check and broadcast the arguments of `FlowLaw.evaluate` of a law with an ambient pressure.

    Raises: ValueError: a fill ratio outside the range, a NaN, or a negative absolute pressure.
    """
    largest, ambient = law.max_fill_ratio, law.ambient_pressure
    x = _within(fill_ratio, largest, "fill_ratio")
    opposite = largest - x if opposite_fill_ratio is None else opposite_fill_ratio
    y = _within(opposite, largest, "opposite_fill_ratio")
    p = np.asarray(plain_number(gas_pressure, "Pa")[0], dtype=np.float64)
    if not (np.isfinite(p) & (p + ambient >= 0)).all():
        raise ValueError(f"gas_pressure must be finite and at least minus the ambient {ambient:g} Pa")
    wet = np.asarray(primed, dtype=np.bool_)
    if not x.shape == y.shape == p.shape == wet.shape:
        x, y, p, wet = np.broadcast_arrays(x, y, p, wet)
    return x, y, p, wet


def _within(fill_ratio: npt.ArrayLike, largest: float, name: str) -> FloatArray:
    x = np.asarray(plain_number(fill_ratio, "")[0], dtype=np.float64)
    if not ((x >= -FILL_SLACK) & (x <= largest + FILL_SLACK)).all():
        raise ValueError(f"{name} must lie within [0, {largest:g}]")
    return clipped(x, 0.0, largest)


def law_text(law: Any) -> str:
    """Summary of the disc, tube and liquid of a complete law, in a few lines."""
    bore = 1e3 * math.sqrt(4 * law.tube_area / math.pi)
    return summary_text(
        (
            f"Flow law {law.name!r}",
            f"fill ratios 0 to {law.max_fill_ratio:g} of chambers of {1e6 * law.chamber_volume:.4g} ml",
            f"tube of {bore:.4g} mm bore, liquid of {law.density:.4g} kg/m^3",
            "velocity in the tube: evaluate(fill_ratio=, gas_pressure=)",
        )
    )


FORMAT: Final = "ringbalance law"
VERSION: Final = 5


def save_record(*, path: Path, record: object) -> Path:
    """Write a record of floats, arrays, texts and other such records.

    Raises: TypeError: a value that such a file cannot hold.
    Raises: ValueError: a value that is not finite.
    Raises: OSError: the file cannot be written; nothing is left behind.
    """
    content = {"format": FORMAT, "version": VERSION, "law": _plain(record)}
    return write_whole(path, json.dumps(content, allow_nan=False) + "\n")


def _plain(value: object) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        named = {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
        return {"type": type(value).__name__} | named
    if isinstance(value, np.ndarray):
        return [float(v) for v in value]
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    # The order matters: bool is an int, and a NumPy float is a float.
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, float | int):
        return float(value)
    raise TypeError(f"a law's file cannot hold {type(value).__name__}")


class MomentCurve(Protocol):
    """Balancing moment of a pair of opposite chambers from their fill ratios.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> moment: rb.MomentCurve = rb.calibrate(scene).flow_law.moment
        >>> f"{moment.pair_moment(fill_ratio=0.4, opposite_fill_ratio=0.1) * 1e6:.0f} g mm"
        '744 g mm'
    """

    def pair_moment(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> FloatArray:
        """Moment along the pair's axis, positive towards the chamber that has `fill_ratio`.

        Args: `fill_ratio`: x of the chamber on the positive side of the axis, any shape.
            `opposite_fill_ratio`: of the opposite chamber, broadcast with `fill_ratio`.
        """
        ...

    def pair_vector(self, *, fill_ratio: npt.ArrayLike, opposite_fill_ratio: npt.ArrayLike) -> ComplexArray:
        """`pair_moment` and, as the imaginary part, the moment across the axis of an asymmetric chamber."""
        ...


@dataclass(frozen=True, kw_only=True)
class BalancerModel:
    """Model of one balancer for the closed loop."""

    name: str
    """ "paper", "calibrated", ..."""
    flow: FlowLaw
    moment: MomentCurve
    chamber_volume: float
    """V of one chamber, m^3."""
    tube_area: float
    """S, m^2."""
    density: float
    """kg/m^3."""

    @classmethod
    def of(cls, law: CompleteLaw) -> BalancerModel:
        """The balancer that a complete law describes. Returns: BalancerModel with the law's name."""
        return cls(
            name=law.name,
            flow=law,
            moment=law.moment,
            chamber_volume=law.chamber_volume,
            tube_area=law.tube_area,
            density=law.density,
        )


class CompleteLaw(FlowLaw, Protocol):
    """A flow law that carries all else that the closed loop needs; what `load_law` returns.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> law: rb.CompleteLaw = rb.calibrate(scene).flow_law
        >>> f"{law.chamber_volume * 1e6:.2f} ml, {law.max_fill_ratio}"
        '67.69 ml, 0.5'
    """

    @property
    def moment(self) -> MomentCurve:
        """Moment of a pair that goes with the law."""
        ...

    @property
    def chamber_volume(self) -> float:
        """V of one chamber, m^3."""
        ...

    @property
    def tube_area(self) -> float:
        """S, m^2."""
        ...

    @property
    def density(self) -> float:
        """rho, kg/m^3."""
        ...

    def table(self) -> Mapping[str, FloatArray]:
        """Plain arrays for use in other code, named in the implementing law's docstring."""
        ...

    def save(self, path: Path | str) -> Path:
        """Write the law to a file that `load_law` reads back bit for bit."""
        ...


_OF_BALANCER: Final = ("max_fill_ratio", "moment", "chamber_volume", "tube_area", "density")


@dataclass(frozen=True, kw_only=True)
class _Velocities:
    """Flow of a law, its shapes checked, and the two attributes that every law has."""

    law: Any
    name: str
    max_fill_ratio: float

    def evaluate(self, **conditions: Any) -> Flow:
        flow: Flow = self.law.evaluate(**conditions)
        shape = np.broadcast_shapes(*(np.shape(value) for value in conditions.values() if value is not None))
        names = ("velocity", "uncertainty", "regime", "primed")
        if not all(hasattr(flow, name) for name in names):
            raise TypeError(f"evaluate of the law {self.name} returns a Flow, not {flow!r}")
        for name in names:
            if (returned := np.shape(getattr(flow, name))) != shape:
                raise TypeError(
                    f"evaluate of the law {self.name} returns {name} of shape {returned} for conditions of "
                    f"shape {shape}: all arrays of its Flow have the shape of the conditions"
                )
        return flow


def lacking(law: object) -> tuple[str, ...]:
    """Names of the attributes that a law lacks and a balancer needs besides its velocities."""
    return tuple(name for name in _OF_BALANCER if not hasattr(law, name))


def completed_model(law: object, *, by: CompleteLaw) -> BalancerModel:
    """Balancer of a law of the caller's own; attributes that the law lacks come from `by`.

    A law without a name, or with that of a law of the program, as a wrapper may have, is named by its class.

    Raises: TypeError: a law without velocities.
    """
    if not callable(getattr(law, "evaluate", None)):
        raise TypeError("a flow law has evaluate(*, fill_ratio, opposite_fill_ratio, gas_pressure, primed)")
    values = {name: getattr(law, name, getattr(by, name)) for name in _OF_BALANCER}
    largest, name = values.pop("max_fill_ratio"), getattr(law, "name", "")
    if name in ("", by.name, "paper"):
        name = type(law).__name__
    return BalancerModel(name=name, flow=_Velocities(law=law, name=name, max_fill_ratio=largest), **values)
