"""Kinds of measurements that a fit takes: columns, what is measured, on which balancer, an empty file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any, Final

from ringbalance.identification.data.tables import dimension_of, split_head
from ringbalance.scene.faults import SceneError, did_you_mean
from ringbalance.scene.units import DIMENSIONS, FieldError

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
            hint = f"; is [{self.unit}] meant?" if self.unit else ""
            raise FieldError(f"it is too large{hint}", self._range())

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
    balancer: str
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


def _column(head: str, meaning: str, **declared: Any) -> Column:
    """A column by its head in the template, such as "time [s]"."""
    name, unit = split_head(head) or (head, "")
    return Column(
        name=name, dimension=dimension_of(unit) if unit else None, unit=unit, meaning=meaning, **declared
    )


_measured: Final = partial(_column, measured=True)
_positive: Final = partial(_column, above_zero=True)
_amplitude: Final = partial(_measured, amplitude=True, lowest=0.0, highest=0.2)
_fill: Final = partial(_column, "fill_ratio", lowest=0.0, highest=1.0)
_angle: Final = partial(_column, lowest=-_TURNS, highest=_TURNS)
_phase: Final = partial(
    _angle,
    meaning="of that vibration, positive with the rotation, from the mark of the rotor",
    measured=True,
)
_WIDTH: Final = _positive(
    "uncertainty",
    "expanded uncertainty (95 %) relative to the measured values, as a number such as 0.02",
    optional=True,
    highest=1.0,
)
_GAS: Final = _positive("pressure [MPa]", "gas pressure in the driven chamber, gauge")
# At most of the order of what empties a chamber of an oil; beyond it milliseconds were meant.
_GAS_TIME: Final = _positive("gas_time [ms]", "valve-open time", highest=100.0)

_TRIAL_WEIGHT: Final = DataKind(
    title="vibration with a known unbalance on the rotor",
    balancer="liquid_ring",
    columns=(
        _column(
            "unbalance [g*mm]",
            "of the trial weight, mass times radius; 0 is the run without it",
            lowest=0.0,
        ),
        _angle("angle [deg]", "of the trial weight on the rotor, positive with the rotation"),
        _amplitude("amplitude [um]", "of the vibration"),
        _phase("phase [deg]"),
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
        _GAS,
        _amplitude("amplitude_before [um]", "of the vibration before the injection"),
        _phase("phase_before [deg]"),
        _amplitude("amplitude_after [um]", "of the vibration after it"),
        _phase("phase_after [deg]"),
        _fill(
            meaning="fill ratio of the driven chamber before; without this column it follows from the "
            "injections above in the same series, and at first from the scene's initial_fill",
            optional=True,
        ),
    ),
)

_TRANSFER: Final = DataKind(
    title="liquid that one injection moves, weighed or measured by volume",
    balancer="liquid_ring",
    columns=(
        _fill(meaning="fill ratio of the driven chamber before"),
        _GAS,
        _GAS_TIME,
        _measured("mass [g]", "moved, weighed", lowest=0.0),
        _measured("volume [ml]", "moved, measured by volume", lowest=0.0),
    ),
    one_of=("mass", "volume"),
)

_FLOW: Final = DataKind(
    title="flow through the tube alone, at rest",
    balancer="liquid_ring",
    columns=(
        _positive("pressure_difference [kPa]", "between the ends of the tube"),
        _positive("flow_rate [ml/s]", "volume flow", measured=True),
    ),
)

_PRESSURE: Final = DataKind(
    title="pressure of the turning liquid at a wall or port",
    balancer="liquid_ring",
    columns=(
        _positive("radius [mm]", "of the place where the pressure is measured"),
        _fill(meaning="fill ratio of the chamber"),
        _positive("surface_radius [mm]", "of the free surface"),
        _positive("speed [rpm]", "of the rotor; that of the scene without this column", optional=True),
        _measured("pressure [kPa]", "measured, over that of the gas in the chamber", lowest=0.0),
    ),
    one_of=("fill_ratio", "surface_radius"),
)

_RUN_UP: Final = DataKind(
    title="vibration of the rotor over its speed, both masses clamped",
    balancer="eccentric_mass",
    columns=(
        _positive("speed [rpm]", "of the rotor"),
        _amplitude("amplitude [um]", "of the vibration"),
        _phase("phase [deg]"),
    ),
)

_POSITIONING: Final = DataKind(
    title="angle of one mass under a constant motor voltage",
    balancer="eccentric_mass",
    columns=(
        _column("time [s]", "from when the voltage was applied", lowest=0.0, highest=100.0),
        _column("voltage [V]", "of the motor", highest=1000.0),
        _column("speed [rpm]", "of the rotor", lowest=0.0, highest=1000.0),
        _measured("angle [deg]", "moved by the mass on its track since then, not wrapped"),
        _column(
            "moved_mass",
            "1 or 2, the mass that moves while the other one is clamped; 1 without this column",
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


def kinds_of(balancer: str) -> tuple[str, ...]:
    """Names of the kinds that belong to a balancer."""
    kinds: dict[str, list[str]] = {}
    for name, kind in KINDS.items():
        kinds.setdefault(kind.balancer, []).append(name)
    return tuple(kinds.get(balancer, ()))


"""By the word that a file's `kind` has."""


def unknown_kind(kind: str) -> str:
    """What is wrong with a word that is no kind."""
    return f"this kind of data cannot be fitted{did_you_mean(kind, KINDS)}"


def template(kind: str) -> str:
    """Text of a file of one kind that lacks only its rows; lines that begin with ## explain the columns.

    Raises: SceneError: no such kind.
    """
    if kind not in KINDS:
        problem, allowed = unknown_kind(kind), ", ".join(KINDS)
        raise SceneError.of_option(option="--template", value=kind, problem=problem, allowed=allowed)
    needed = [column for column in KINDS[kind].columns if not column.optional and not _is_other(column, kind)]
    heads = [*(["chamber"] if KINDS[kind].has_chamber else []), *(column.head for column in needed)]
    lines = [*_first_lines(kind), "##", *_explained(kind), ",".join([*heads, "series"])]
    return "\n".join(lines) + "\n"


def _is_other(column: Column, kind: str) -> bool:
    """Whether it may stand in place of a column that the template has."""
    return column.name in KINDS[kind].one_of[1:]


def _first_lines(kind: str) -> Iterator[str]:
    yield f'# kind = "{kind}"  # {KINDS[kind].title}'
    yield '# source = ""  # rig, run and date'
    amplitudes = [column for column in KINDS[kind].measured if column.amplitude]
    measured = amplitudes or [column for column in KINDS[kind].measured if not _is_other(column, kind)]
    if amplitudes:
        yield f'# amplitude = ""  # {", ".join(AMPLITUDES)}: how every amplitude in the file is counted'
    stated = ", ".join(f'{column.name} = "1 {column.unit}"' for column in measured)
    yield f"## uncertainty = {{ {stated} }}  # expanded (95 %), or relative such as 0.02; absent: estimated"


def _explained(kind: str) -> Iterator[str]:
    """A line for each column that the file may have."""
    if KINDS[kind].has_chamber:
        yield "## chamber: letter of the driven chamber, A for the first"
    for column in KINDS[kind].columns:
        word = "or " if _is_other(column, kind) else "optional " if column.optional else ""
        yield f"## {word}{column.head}: {column.meaning}"
    widths = ", ".join(column.name for column in KINDS[kind].uncertainties() if column.dimension)
    yield f"## optional {widths}: expanded uncertainty (95 %) of each row"
    yield "## series: run, rig or day that a row belongs to; rows in the order in which they were measured"
    yield "## optional note: any remark; tells apart rows that are otherwise the same"
