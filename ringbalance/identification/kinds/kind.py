"""Kind of measurement: meaning and unit of each column, and prediction of the measured ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

import numpy as np

from ringbalance.identification.tables import dimension_of, split_head
from ringbalance.scene.arrays import BoolArray, ComplexArray, FloatArray, IntArray, StringArray
from ringbalance.scene.uncertain import NORMAL_95
from ringbalance.scene.units import DIMENSIONS, FieldError, format_quantity

_LARGEST: Final[Mapping[str, float]] = {
    "length": 10.0,
    "unbalance": 1e3,
    "time": 1e5,
    "pressure": 1e9,
    "mass": 1e4,
    "volume": 10.0,
    "flow_rate": 10.0,
    "speed": 1e5,
    "voltage": 1e4,
}
"""Largest plausible value by dimension, SI, far above any rig; beyond it the unit is wrong."""
_LARGEST_ANGLE_RAD: Final = 4 * math.pi
"""Largest phase or angle of a measurement; larger numbers are degrees in a column of radians."""


@dataclass(frozen=True, kw_only=True)
class DataColumn:
    """Column of numbers in a file of measurements."""

    name: str
    dimension: str | None
    """Key of `DIMENSIONS`; None for a number without unit."""
    unit: str
    """Unit in the template; empty for a number without unit."""
    meaning: str
    measured: bool = False
    amplitude: bool = False
    """True if the column follows the file's convention of amplitudes."""
    optional: bool = False
    lowest: float = -math.inf
    """Lowest allowed value, SI."""
    highest: float = math.inf
    above_zero: bool = False
    integer: bool = False

    @property
    def head(self) -> str:
        """Name with unit, as in the head of the column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def written(self, value: float) -> str:
        """Text of a value, SI, in the template's unit."""
        return (
            format_quantity(value, self.dimension, self.unit, digits=3) if self.dimension else f"{value:.3g}"
        )

    def check(self, value: float) -> None:
        """Check a value, SI. Raises: FieldError: a value that the column cannot have."""
        largest = min(self.highest, _LARGEST.get(self.dimension or "", math.inf))
        if self.above_zero and not value > 0:
            problem = "it is not above zero"
        elif value < self.lowest:
            problem = "it is negative" if self.lowest == 0 else "it is too small"
        elif self.integer and value != round(value):
            problem = "it is not a whole number"
        elif abs(value) > largest:
            problem = "it is too large" + (f"; is [{self.unit}] meant?" if self.unit else "")
        else:
            return
        unit = DIMENSIONS[self.dimension].si_unit if self.dimension else ""
        low = self.lowest if self.lowest > -math.inf else -largest
        allowed = "above 0" if self.above_zero else f"from {low:.4g}"
        end = "" if largest == math.inf else f" to {largest:.4g} {unit}".rstrip()
        raise FieldError(problem, allowed + end)


@dataclass(frozen=True, kw_only=True)
class Observations:
    """Rows of one file of measurements, all of one kind."""

    kind: str
    file: str
    source: str = ""
    """Rig, run and date, from the file's first lines."""
    sha256: str = ""
    """Hash of the file's bytes."""
    lines: IntArray
    """Line of each row in the file, from 1."""
    series: StringArray
    """Tube, run, rig or day of each row; rows of a series share their systematic errors."""
    chamber: StringArray
    """Letter of the driven chamber; empty if the kind has none."""
    columns: Mapping[str, FloatArray]
    """Values by name, SI; amplitudes zero to peak. Optional columns that the file lacks are absent."""
    remarks: tuple[str, ...] = ()
    """Changes of the file's columns, a sentence each."""
    leads: Mapping[str, float] = field(default_factory=dict)
    """Lead of a measured velocity or acceleration over its displacement, rad, by column of the phase."""
    uncertainty: Mapping[str, FloatArray]
    """Expanded uncertainty (95 %), absolute, SI, by measured column; noise of absent columns is estimated."""

    def __len__(self) -> int:
        return int(self.lines.size)

    def where(self, chosen: BoolArray | IntArray) -> Observations:
        """Copy with some of the rows."""
        return replace(
            self,
            lines=self.lines[chosen],
            series=self.series[chosen],
            chamber=self.chamber[chosen],
            columns={name: column[chosen] for name, column in self.columns.items()},
            uncertainty={name: width[chosen] for name, width in self.uncertainty.items()},
        )

    def with_columns(self, **columns: FloatArray) -> Observations:
        """Copy with some columns replaced."""
        return replace(self, columns={**self.columns, **columns})

    def rows_of(self, values: FloatArray) -> FloatArray:
        """Values of `measured`, one row of numbers for each row of the file, shape (n, 1) or (n, 2)."""
        return np.reshape(values, (-1, len(self))).T

    def vectors(self, when: str = "") -> ComplexArray:
        """a exp(j phase) of each row, m zero to peak. Args: `when`: "", "_before" or "_after"."""
        return np.asarray(self.columns[f"amplitude{when}"] * np.exp(1j * self.columns[f"phase{when}"]))

    def vector_covariance(self, when: str) -> FloatArray:
        """Covariance of real and imaginary part of each vector, m^2, shape (n, 2, 2).

        Standard deviation sigma_a along the vector, and sigma_a or, if given, a sigma_phase across it.
        """
        size, angle = self.columns[f"amplitude{when}"], self.columns[f"phase{when}"]
        radial = tangential = self.uncertainty[f"amplitude{when}"] / NORMAL_95
        if f"phase{when}" in self.uncertainty:
            tangential = np.where(size > 0, size * self.uncertainty[f"phase{when}"] / NORMAL_95, radial)
        c, s, a, b = np.cos(angle), np.sin(angle), radial**2, tangential**2
        mixed = (a - b) * c * s
        return np.moveaxis(np.array([[a * c**2 + b * s**2, mixed], [mixed, a * s**2 + b * c**2]]), -1, 0)


Grid = Mapping[str, Sequence[float]]
"""Possible settings of a measurement, SI, by column."""
Ranges = Mapping[str, tuple[float, float]]
"""Lowest and highest value of a scene, SI, by column; from zero if only the upper end is meaningful."""


def _by_no_scene(_scene: Any, observations: Observations, _models: Any) -> FloatArray:
    raise ValueError(f"no scene predicts data of the kind {observations.kind}")


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Kind of measurement: on the machine of a scene, for `fit`, or on a test bench without a scene."""

    title: str
    columns: tuple[DataColumn, ...]
    one_of: tuple[str, ...] = ()
    """Alternative columns; a file has exactly one of them."""
    has_chamber: bool = False
    """True if a column `chamber` has the letter of the driven chamber."""
    balancer: str = ""
    """Balancer of the scenes that predict this kind; empty: a test bench without a scene."""
    any_rotor: bool = False
    """True if scenes of a balancer without specific kinds predict this kind too."""
    predict: Callable[[Any, Observations, Any], FloatArray] = _by_no_scene
    """Function from scene, observations and models (`device.Models`) to predicted numbers; a vibration has
    real and imaginary part."""
    informs: Callable[[Observations], tuple[str, ...]] = lambda _: ()
    """Function from observations to the parameters that are fitted by default."""
    free: Callable[[Observations], FloatArray] = lambda observations: np.zeros((len(observations), 0))
    """Function from observations to effects of unknowns that are no parameters, such as the vibration without
    trial weight, one column for each."""
    obstacle: Callable[[Any, Observations], str] = lambda _, __: ""
    """Function from scene and observations to the reason why they cannot be fitted; empty if they can."""
    offers: Callable[[Any], Grid] = lambda _: {}
    """Function from a scene to possible further measurements."""
    ranges: Callable[[Any], Ranges] = lambda _: {}
    """Function from a scene to its ranges of the columns."""
    stated: Callable[[Observations], tuple[FloatArray, FloatArray]] | None = None
    """Function from observations of a test bench to prediction and stated expanded uncertainty (95 %)."""

    @property
    def has_amplitudes(self) -> bool:
        """True if any column follows the convention of amplitudes."""
        return any(column.amplitude for column in self.columns)

    @property
    def measured(self) -> tuple[DataColumn, ...]:
        """Columns that are predicted."""
        return tuple(column for column in self.columns if column.measured)

    @property
    def texts(self) -> tuple[str, ...]:
        """Columns of text."""
        return ("series", "note", *(["chamber"] if self.has_chamber else []))

    def column(self, name: str) -> DataColumn | None:
        """Declaration of a column, also of an uncertainty; None if the kind has no such column."""
        return {column.name: column for column in (*self.columns, *self.uncertainties())}.get(name)

    def uncertainties(self) -> Iterator[DataColumn]:
        """Yield the columns that may state the uncertainty of each row."""
        for column in self.measured:
            yield replace(
                _WIDTH,
                name=f"uncertainty_{column.name}",
                dimension=column.dimension,
                unit=column.unit,
                meaning=f"expanded uncertainty (95 %) of {column.name}",
                amplitude=column.amplitude,
                highest=math.inf,
            )
        yield _WIDTH

    @property
    def _vibrations(self) -> tuple[str, ...]:
        """Suffixes of the names of a row's vibrations: "", or "_before" and "_after"."""
        return tuple(c.name.removeprefix("phase") for c in self.measured if c.name.startswith("phase"))

    def _noisy(self, observations: Observations) -> list[str]:
        """Measured columns with independent noise; a phase with its amplitude has none."""
        names = [column.name for column in self.measured if not column.name.startswith("phase")]
        return [name for name in names if name in observations.columns] or names

    def noisy_column(self, observations: Observations) -> str:
        """Name of the measured column whose noise is stated or estimated."""
        return self._noisy(observations)[-1]

    def noise_given(self, observations: Observations) -> bool:
        """True if the file states the noise."""
        return all(name in observations.uncertainty for name in self._noisy(observations))

    def numbers(self, observations: Observations) -> FloatArray:
        """Measured numbers, SI: one for each row, or the two parts of a vibration or of its change."""
        if not self._vibrations:
            return observations.columns[self.noisy_column(observations)]
        *before, last = (observations.vectors(when) for when in self._vibrations)
        return parts(last - sum(before))

    def covariance(self, observations: Observations) -> FloatArray:
        """Covariance of the errors of `numbers`; if the noise is estimated, in units of the variance of one
        reading.

        Equal vibrations after one injection and before the next one of its series are one measurement: its
        error enters both changes, with opposite signs.
        """
        count, stated = len(observations), self.noise_given(observations)
        if not self._vibrations:
            width = observations.uncertainty[self.noisy_column(observations)] if stated else NORMAL_95
            return np.diag((width / NORMAL_95 * np.ones(count)) ** 2)
        each = [
            observations.vector_covariance(when) if stated else np.broadcast_to(np.eye(2), (count, 2, 2))
            for when in self._vibrations
        ]
        full, rows = np.zeros((2, count, 2, count)), np.arange(count)
        full[:, rows, :, rows] = sum(each)
        if len(each) > 1:
            before, after = observations.vectors("_before"), observations.vectors("_after")
            last: dict[str, int] = {}
            for i, series in enumerate(observations.series.tolist()):
                if series in last and before[i] == after[last[series]]:
                    earlier = last[series]
                    full[:, i, :, earlier] = full[:, earlier, :, i] = -each[-1][earlier]
                last[series] = i
        return full.reshape(2 * count, 2 * count)


def parts(vector: ComplexArray) -> FloatArray:
    """Real parts, then imaginary parts, shape (2 n,)."""
    return np.concatenate([vector.real, vector.imag])


def always(*names: str) -> Callable[[Observations], tuple[str, ...]]:
    """Function that returns these parameters for any data of a kind."""
    return lambda _: names


def column(head: str, meaning: str, **declared: Any) -> DataColumn:
    """Column by its head in the template, such as "time [s]"."""
    name, unit = split_head(head) or (head, "")
    return DataColumn(
        name=name, dimension=dimension_of(unit) if unit else None, unit=unit, meaning=meaning, **declared
    )


measured: Final = partial(column, measured=True)
positive: Final = partial(column, above_zero=True)
angle: Final = partial(column, lowest=-_LARGEST_ANGLE_RAD, highest=_LARGEST_ANGLE_RAD)
amplitude: Final = partial(measured, amplitude=True, lowest=0.0, highest=0.2)
phase: Final = partial(
    angle, meaning="of that vibration, positive with the rotation, from the mark of the rotor", measured=True
)
_WIDTH: Final = positive(
    "uncertainty",
    "expanded uncertainty (95 %) relative to the measured values, as a number such as 0.02",
    optional=True,
    highest=1.0,
)
