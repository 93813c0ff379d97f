"""A kind of measurement: what each column means, its unit, and how a model predicts what is measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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
"""By dimension, SI: what no rig has, with room to spare; beyond it the unit is wrong."""
_LARGEST_ANGLE_RAD: Final = 4 * math.pi
"""Largest phase or angle of a measurement; beyond it degrees stand in a column of radians."""


@dataclass(frozen=True, kw_only=True)
class DataColumn:
    """One column of numbers."""

    name: str
    dimension: str | None
    """Key of `DIMENSIONS`; None for a number without unit."""
    unit: str
    """Unit in the template; empty for a number without unit."""
    meaning: str
    measured: bool = False
    amplitude: bool = False
    """True where it follows the file's convention of amplitudes."""
    optional: bool = False
    lowest: float = -math.inf
    """SI."""
    highest: float = math.inf
    above_zero: bool = False
    integer: bool = False

    @property
    def head(self) -> str:
        """Name with unit, as it stands over the column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def written(self, value: float) -> str:
        """A value, SI, in the template's unit."""
        return (
            format_quantity(value, self.dimension, self.unit, digits=3) if self.dimension else f"{value:.3g}"
        )

    def check(self, value: float) -> None:
        """Raises: FieldError: a value, SI, that the column cannot have."""
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
    """The rows of one file of measurements, all of one kind."""

    kind: str
    file: str
    source: str = ""
    """Rig, run and date, as the file's first lines have them."""
    sha256: str = ""
    """Hash of the file's bytes."""
    lines: IntArray
    """Line of each row in the file, from 1."""
    series: StringArray
    """Tube, run, rig or day that a row belongs to: its rows share their systematic errors."""
    chamber: StringArray
    """Letter of the driven chamber; empty where the kind has none."""
    columns: Mapping[str, FloatArray]
    """SI, by name; amplitudes zero to peak. An optional column that the file does not have is absent."""
    uncertainty: Mapping[str, FloatArray]
    """Expanded (95 %), absolute, SI, by measured column; where one is absent its noise is estimated."""

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
        """Covariance of each vector's two parts, m^2, shape (n, 2, 2).

        Along the vector sigma_a, across it sigma_a or, where given, a sigma_phase.
        """
        size, angle = self.columns[f"amplitude{when}"], self.columns[f"phase{when}"]
        radial = tangential = self.uncertainty[f"amplitude{when}"] / NORMAL_95
        if f"phase{when}" in self.uncertainty:
            tangential = np.where(size > 0, size * self.uncertainty[f"phase{when}"] / NORMAL_95, radial)
        c, s, a, b = np.cos(angle), np.sin(angle), radial**2, tangential**2
        mixed = (a - b) * c * s
        return np.moveaxis(np.array([[a * c**2 + b * s**2, mixed], [mixed, a * s**2 + b * c**2]]), -1, 0)


Grid = Mapping[str, Sequence[float]]
"""Values that could be set, SI, by column."""
Ranges = Mapping[str, tuple[float, float]]
"""Lowest and highest value of a scene, SI, by column; from zero where only an upper end means anything."""


def _by_no_scene(_scene: Any, observations: Observations, _models: Any) -> FloatArray:
    raise ValueError(f"no scene predicts data of the kind {observations.kind}")


@dataclass(frozen=True, kw_only=True)
class Kind:
    """One kind of measurement: of a scene's machine, which `fit` takes, or of a test bench without one."""

    title: str
    columns: tuple[DataColumn, ...]
    one_of: tuple[str, ...] = ()
    """Columns of which a file has exactly one."""
    has_chamber: bool = False
    """True where a column `chamber` has the letter of the driven chamber."""
    balancer: str = ""
    """Balancer whose scenes predict it; empty: a test bench without a scene."""
    any_rotor: bool = False
    """True where the scenes of a balancer without kinds of its own predict it too."""
    predict: Callable[[Any, Observations, Any], FloatArray] = _by_no_scene
    """Scene, observations and models (`device.Models`) to what was measured; a vibration counts as its real
    and its imaginary part."""
    informs: Callable[[Observations], tuple[str, ...]] = lambda _: ()
    """Parameters that are fitted to such data where the user names none."""
    free: Callable[[Observations], FloatArray] = lambda observations: np.zeros((len(observations), 0))
    """Effect of unknowns that are no parameters, such as the vibration without trial weight, one column
    each."""
    obstacle: Callable[[Any, Observations], str] = lambda _, __: ""
    """Scene and observations to why the one cannot be fitted to the other; empty where it can."""
    offers: Callable[[Any], Grid] = lambda _: {}
    """Scene to what could be measured next."""
    ranges: Callable[[Any], Ranges] = lambda _: {}
    """Scene to what it has of the columns."""
    stated: Callable[[Observations], tuple[FloatArray, FloatArray]] | None = None
    """Prediction for a test bench, and the expanded uncertainty (95 %) that the program states of it."""

    @property
    def has_amplitudes(self) -> bool:
        """True where the convention of amplitudes matters."""
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
        """Declaration of a column, of that of an uncertainty too; None where the kind has none."""
        return {column.name: column for column in (*self.columns, *self.uncertainties())}.get(name)

    def uncertainties(self) -> Iterator[DataColumn]:
        """The columns that may state how well each row is known."""
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
        """Ends of the names of the vibrations that a row has: "", or "_before" and "_after"."""
        return tuple(c.name.removeprefix("phase") for c in self.measured if c.name.startswith("phase"))

    def _noisy(self, observations: Observations) -> list[str]:
        """Measured columns of data with a noise of their own, as a phase beside its amplitude has not."""
        names = [column.name for column in self.measured if not column.name.startswith("phase")]
        return [name for name in names if name in observations.columns] or names

    def noisy_column(self, observations: Observations) -> str:
        """Name of the measured column whose noise is stated or estimated."""
        return self._noisy(observations)[-1]

    def noise_given(self, observations: Observations) -> bool:
        """True where the file states the noise."""
        return all(name in observations.uncertainty for name in self._noisy(observations))

    def numbers(self, observations: Observations) -> FloatArray:
        """Measured numbers: one a row, or the parts of a vibration or of its change."""
        if not self._vibrations:
            return observations.columns[self.noisy_column(observations)]
        *before, last = (observations.vectors(when) for when in self._vibrations)
        return parts(last - sum(before))

    def covariance(self, observations: Observations) -> FloatArray:
        """Covariance of the errors of `numbers`; in units of one reading's where the noise is estimated.

        A vibration that stands as that after one injection and, digit for digit, as that before the next one
        of its series was measured once: its error enters both changes, with opposite signs.
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
    """Parameters that all data of a kind inform."""
    return lambda _: names


def column(head: str, meaning: str, **declared: Any) -> DataColumn:
    """A column by its head in the template, such as "time [s]"."""
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
