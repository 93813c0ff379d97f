"""Kinds of measurements that a fit takes: their columns, what is measured, and on which balancer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from ringbalance.scene.dimensions import DIMENSIONS
from ringbalance.scene.faults import did_you_mean
from ringbalance.scene.units import FieldError

AMPLITUDES: Final[Mapping[str, float]] = MappingProxyType(
    {"zero_to_peak": 1.0, "peak_to_peak": 0.5, "rms": math.sqrt(2)}
)
"""Convention of an amplitude to the factor that makes it zero to peak; of a harmonic vibration."""
_WORDS: Final = {"gas_time": "valve-open time"}
"""Names of columns that a sentence has another word for."""
TEXTS: Final = ("series", "note")
"""Columns of text that every kind may have."""
_TURNS: Final = 4 * math.pi
"""Largest phase or angle of a measurement, rad; beyond it degrees stand in a column of radians."""


_LARGEST: Final[Mapping[str, float]] = MappingProxyType(
    {
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
)
"""By dimension, SI: what no rig has, with room to spare; beyond it the unit is wrong."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column of numbers, or of chamber letters."""

    name: str
    dimension: str | None
    """Key of `DIMENSIONS`; None for a number without unit."""
    unit: str
    """That the template uses; empty for a number without unit."""
    meaning: str
    measured: bool = False
    amplitude: bool = False
    """Whether it follows the file's convention of amplitudes."""
    optional: bool = False
    lowest: float = -math.inf
    """SI."""
    highest: float = math.inf
    above_zero: bool = False
    whole: bool = False

    @property
    def head(self) -> str:
        """Name with unit, as it stands over the column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def words(self) -> str:
        """Its name in a sentence."""
        return _WORDS.get(self.name, self.name.replace("_", " "))

    def check(self, value: float) -> None:
        """Raises: FieldError: a value, SI, that the column cannot have."""
        if self.above_zero and not value > 0:
            raise FieldError("it is not above zero", self._range())
        if value < self.lowest:
            raise FieldError("it is negative" if self.lowest == 0 else "it is too small", self._range())
        if self.whole and value != round(value):
            raise FieldError("it is not a whole number", self._range())
        if abs(value) > self._largest:
            raise FieldError(f"it is too large; is [{self.unit or 1}] meant?", self._range())

    @property
    def _largest(self) -> float:
        return min(self.highest, _LARGEST.get(self.dimension or "", math.inf))

    def _range(self) -> str:
        unit = next(iter(DIMENSIONS[self.dimension].units)) if self.dimension else ""
        low = self.lowest if self.lowest > -math.inf else -self._largest
        start = "above 0" if self.above_zero else f"from {low:.4g}"
        end = "" if self._largest == math.inf else f"to {self._largest:.4g} {unit}"
        return " ".join(filter(None, (start, end.strip())))


@dataclass(frozen=True, kw_only=True)
class DataKind:
    """One kind of measurement."""

    title: str
    balancer: Literal["liquid_ring", "eccentric_mass"]
    columns: tuple[Column, ...]
    one_of: tuple[str, ...] = ()
    """Columns of which a file has exactly one."""
    has_chamber: bool = False
    """Whether a column `chamber` has the letter of the driven chamber."""

    @property
    def has_amplitudes(self) -> bool:
        """Whether the convention of amplitudes matters."""
        return any(column.amplitude for column in self.columns)

    @property
    def measured(self) -> tuple[Column, ...]:
        """Columns that a fit predicts."""
        return tuple(column for column in self.columns if column.measured)

    @property
    def texts(self) -> tuple[str, ...]:
        """Columns of text."""
        return (*TEXTS, "chamber") if self.has_chamber else TEXTS

    def column(self, name: str) -> Column | None:
        """Declaration of a column, of that of an uncertainty too; None where the kind has none."""
        found = {column.name: column for column in (*self.columns, *self.uncertainties())}
        return found.get(name)

    def uncertainties(self) -> Iterator[Column]:
        """The columns that may state how well each row is known."""
        for column in self.measured:
            yield Column(
                name=f"uncertainty_{column.name}",
                dimension=column.dimension,
                unit=column.unit,
                meaning=f"expanded uncertainty (95 %) of {column.name}",
                amplitude=column.amplitude,
                optional=True,
                above_zero=True,
            )
        yield Column(
            name="uncertainty",
            dimension=None,
            unit="",
            meaning="expanded uncertainty (95 %) relative to the measured values, as a number such as 0.02",
            optional=True,
            above_zero=True,
            highest=1.0,
        )


def _amplitude(name: str, meaning: str) -> Column:
    return Column(
        name=name, dimension="length", unit="um", meaning=meaning, measured=True, amplitude=True, lowest=0.0
    )


def _angle(name: str, meaning: str, *, measured: bool = False) -> Column:
    return Column(
        name=name,
        dimension="angle",
        unit="deg",
        meaning=meaning,
        measured=measured,
        lowest=-_TURNS,
        highest=_TURNS,
    )


def _positive(name: str, dimension: str, unit: str, meaning: str, *, measured: bool = False) -> Column:
    return Column(
        name=name, dimension=dimension, unit=unit, meaning=meaning, measured=measured, above_zero=True
    )


def _fill(meaning: str, *, optional: bool = False) -> Column:
    return Column(
        name="fill_ratio",
        dimension=None,
        unit="",
        meaning=meaning,
        optional=optional,
        lowest=0.0,
        highest=1.0,
    )


_PHASE: Final = "of that vibration, positive with the rotation, from the mark of the rotor"
_GAS: Final = "gas pressure in the driven chamber, gauge"
_GAS_TIME: Final = Column(
    name="gas_time",
    dimension="time",
    unit="ms",
    meaning="valve-open time",
    above_zero=True,
    highest=100.0,  # of the order of what empties a chamber of an oil; beyond it milliseconds were meant
)

_TRIAL_WEIGHT: Final = DataKind(
    title="vibration with a known unbalance on the rotor",
    balancer="liquid_ring",
    columns=(
        Column(
            name="unbalance",
            dimension="unbalance",
            unit="g*mm",
            meaning="of the trial weight, mass times radius; 0 is the run without it",
            lowest=0.0,
        ),
        _angle("angle", "of the trial weight on the rotor, positive with the rotation"),
        _amplitude("amplitude", "of the vibration"),
        _angle("phase", _PHASE, measured=True),
    ),
)

_TRIAL_AMPLITUDE: Final = DataKind(
    title="amplitude alone of the vibration with a known unbalance on the rotor",
    balancer="liquid_ring",
    columns=tuple(column for column in _TRIAL_WEIGHT.columns if column.name != "phase"),
)

_INJECTION: Final = DataKind(
    title="vibration before and after one injection of gas",
    balancer="liquid_ring",
    has_chamber=True,
    columns=(
        _GAS_TIME,
        _positive("pressure", "pressure", "MPa", _GAS),
        _amplitude("amplitude_before", "of the vibration before the injection"),
        _angle("phase_before", _PHASE, measured=True),
        _amplitude("amplitude_after", "of the vibration after it"),
        _angle("phase_after", _PHASE, measured=True),
        _fill(
            "fill ratio of the driven chamber before; without this column it follows from the injections "
            "above in the same series, and at first from the scene's initial_fill",
            optional=True,
        ),
    ),
)

_TRANSFER: Final = DataKind(
    title="liquid that one injection moves, weighed or measured by volume",
    balancer="liquid_ring",
    columns=(
        _fill("fill ratio of the driven chamber before"),
        _positive("pressure", "pressure", "MPa", _GAS),
        _GAS_TIME,
        Column(name="mass", dimension="mass", unit="g", meaning="moved, weighed", measured=True, lowest=0.0),
        Column(
            name="volume",
            dimension="volume",
            unit="ml",
            meaning="moved, measured by volume",
            measured=True,
            lowest=0.0,
        ),
    ),
    one_of=("mass", "volume"),
)

_FLOW: Final = DataKind(
    title="flow through the tube alone, at rest",
    balancer="liquid_ring",
    columns=(
        _positive("pressure_difference", "pressure", "kPa", "between the ends of the tube"),
        _positive("flow_rate", "flow_rate", "ml/s", "volume flow", measured=True),
    ),
)

_PRESSURE: Final = DataKind(
    title="pressure of the turning liquid at a wall or port",
    balancer="liquid_ring",
    columns=(
        _positive("radius", "length", "mm", "of the place where the pressure is measured"),
        _fill("fill ratio of the chamber"),
        _positive("surface_radius", "length", "mm", "of the free surface"),
        Column(
            name="speed",
            dimension="speed",
            unit="rpm",
            meaning="of the rotor; that of the scene without this column",
            optional=True,
            above_zero=True,
        ),
        Column(
            name="pressure",
            dimension="pressure",
            unit="kPa",
            meaning="measured, over that of the gas in the chamber",
            measured=True,
            lowest=0.0,
        ),
    ),
    one_of=("fill_ratio", "surface_radius"),
)

_RUN_UP: Final = DataKind(
    title="vibration of the rotor over its speed, both masses clamped",
    balancer="eccentric_mass",
    columns=(
        _positive("speed", "speed", "rpm", "of the rotor"),
        _amplitude("amplitude", "of the vibration"),
        _angle("phase", _PHASE, measured=True),
    ),
)

_POSITIONING: Final = DataKind(
    title="angle of one mass under a constant motor voltage",
    balancer="eccentric_mass",
    columns=(
        Column(
            name="time",
            dimension="time",
            unit="s",
            meaning="from when the voltage was applied",
            lowest=0.0,
            highest=100.0,
        ),
        Column(name="voltage", dimension="voltage", unit="V", meaning="of the motor", highest=1000.0),
        Column(
            name="speed", dimension="speed", unit="rpm", meaning="of the rotor", lowest=0.0, highest=1000.0
        ),
        Column(
            name="angle",
            dimension="angle",
            unit="deg",
            meaning="moved by the mass on its track since then, not wrapped",
            measured=True,
        ),
        Column(
            name="moved_mass",
            dimension=None,
            unit="",
            meaning="1 or 2, the mass that moves while the other one is clamped; 1 without this column",
            optional=True,
            lowest=1.0,
            highest=2.0,
            whole=True,
        ),
    ),
)

KINDS: Final[Mapping[str, DataKind]] = MappingProxyType(
    {
        "trial_weight": _TRIAL_WEIGHT,
        "trial_amplitude": _TRIAL_AMPLITUDE,
        "injection": _INJECTION,
        "transfer": _TRANSFER,
        "flow": _FLOW,
        "pressure": _PRESSURE,
        "run_up": _RUN_UP,
        "positioning": _POSITIONING,
    }
)
"""By the word that a file's `kind` has."""


def unknown_kind(kind: str) -> str:
    """What is wrong with a word that is no kind."""
    return f"this kind of data cannot be fitted{did_you_mean(kind, KINDS)}"
