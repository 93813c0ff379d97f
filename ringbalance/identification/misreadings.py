"""Possible misreadings of a file of measurements: single ones, and senses of angles with amplitudes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any, Final

import numpy as np

from ringbalance.controller.rotor import chamber_letters
from ringbalance.identification.kinds.kind import Observations
from ringbalance.scene.arrays import FloatArray

_LONGEST_INJECTION_S: Final = 10.0
"""Longest plausible injection: longer times cannot be seconds stated as milliseconds."""
Change = Callable[[Observations, Any], Observations | None]
"""Function from observations and scene to the observations read differently; None if not applicable."""
Conversion = Callable[[FloatArray, Any], FloatArray]


@dataclass(frozen=True, kw_only=True)
class Misreading:
    """Possible misreading of a file."""

    code: str
    words: str
    change: Change
    settings: bool
    """True if the settings change, hence the predictions."""
    scale: float = 1.0
    """Scale dy'/dy of the measured numbers."""
    column: str = ""
    """Name of the changed column, if the scene has a range for it."""
    together: bool = True
    """True if all files may have been misread in this way together."""


def _exchanged(observations: Observations, _: Any) -> Observations | None:
    """Exchange the columns of before and after, with their uncertainties."""
    if observations.kind != "injection":
        return None
    other = {"before": "after", "after": "before"}

    def swapped(values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        named = {n: n.rpartition("_") for n in values}
        return {
            f"{named[n][0]}_{other[named[n][2]]}" if named[n][2] in other else n: v for n, v in values.items()
        }

    columns, widths = swapped(observations.columns), swapped(observations.uncertainty)
    return replace(observations, columns=columns, uncertainty=widths)


def _turned(name: str, observations: Observations, _: Any) -> Observations | None:
    """Reverse the sign of the angles whose names begin with `name`, as they stand in the file.

    There a phase p of displacement stands as p + lead; reversed, it is -(p + lead) - lead.
    """
    leads = observations.leads
    chosen = {n: -v - 2 * leads.get(n, 0.0) for n, v in observations.columns.items() if n.startswith(name)}
    vibration = any(n.startswith("phase") for n in observations.columns)
    return observations.with_columns(**chosen) if chosen and vibration else None


def _lettered(observations: Observations, scene: Any) -> Observations | None:
    """Count the letters of the chambers against the rotation, from A."""
    if observations.kind != "injection" or scene.disc.chambers < 4:
        return None
    letters = chamber_letters(scene.disc.chambers)
    numbers = [letters.index(letter) for letter in observations.chamber]
    return replace(observations, chamber=np.array([letters[-i % len(letters)] for i in numbers]))


def _amplitudes(factor: float, observations: Observations, _: Any) -> Observations | None:
    """Multiply the amplitudes and their uncertainties by a factor."""
    columns = {n: factor * v for n, v in observations.columns.items() if n.startswith("amplitude")}
    widths = {n: factor * v if n in columns else v for n, v in observations.uncertainty.items()}
    return replace(observations.with_columns(**columns), uncertainty=widths) if columns else None


def _gas(
    name: str, above: float, below: float, convert: Conversion, observations: Observations, scene: Any
) -> Observations | None:
    """Convert the gas pressure or the valve-open time; None outside the limits of an injection."""
    if observations.kind not in ("injection", "transfer"):
        return None
    values = convert(observations.columns[name], scene)
    usable = np.all(values > above) and np.median(values) < below
    return observations.with_columns(**{name: values}) if usable else None


def _pressures(code: str, words: str, convert: Conversion) -> Misreading:
    change = partial(_gas, "pressure", 0.0, math.inf, convert)
    return Misreading(code=code, words=words, change=change, settings=True, column="pressure")


SENSES: Final = (
    Misreading(code="phases_turned", words="phases", change=partial(_turned, "phase"), settings=False),
    Misreading(
        code="weights_turned",
        words="angles of the trial weights",
        change=partial(_turned, "angle"),
        settings=True,
    ),
    Misreading(code="chambers_turned", words="letters of the chambers", change=_lettered, settings=True),
)
"""Angles counted against the rotation, singly and combined."""
AMPLITUDES: Final = tuple(
    Misreading(
        code=f"amplitudes_{code}",
        words=f"amplitudes {words}",
        change=partial(_amplitudes, factor),
        settings=False,
        scale=factor,
    )
    for code, factor, words in (
        ("halved", 0.5, "half as large, such as peak to peak stated as zero to peak"),
        ("doubled", 2.0, "twice as large, such as zero to peak stated as peak to peak"),
        ("over_root_two", math.sqrt(0.5), "0.71 times as large, such as zero to peak stated as rms"),
        ("times_root_two", math.sqrt(2.0), "1.41 times as large, such as rms stated as zero to peak"),
    )
)
"""Wrong amplitudes, singly and with every sense of the angles."""
_OTHERS: Final = (
    Misreading(
        code="before_and_after_exchanged",
        words="vibrations before and after exchanged",
        change=_exchanged,
        settings=False,
        together=False,
    ),
    _pressures(
        "pressures_tenth",
        "gas pressures a tenth as large, such as bar stated as MPa",
        lambda values, _: 0.1 * values,
    ),
    _pressures(
        "pressures_tenfold",
        "gas pressures ten times as large, such as MPa stated as bar",
        lambda values, _: 10.0 * values,
    ),
    _pressures(
        "pressures_absolute",
        "gas pressures as absolute ones, less that of the surroundings",
        lambda values, scene: values - scene.gas.ambient_pressure,
    ),
    Misreading(
        code="times_in_seconds",
        words="valve-open times a thousand times as long, such as seconds stated as milliseconds",
        change=partial(_gas, "gas_time", -math.inf, _LONGEST_INJECTION_S, lambda values, _: 1e3 * values),
        settings=True,
        column="gas_time",
    ),
)
"""Misreadings that are tried singly."""
Joint = tuple[Misreading, ...]


def joint_misreadings() -> Iterator[Joint]:
    """Yield combinations of misreadings, the simplest first."""
    yield from ((each,) for each in _OTHERS)
    senses = [chosen for n in range(len(SENSES) + 1) for chosen in combinations(SENSES, n)]
    yield from senses[1:]
    yield from ((*chosen, each) for each in AMPLITUDES for chosen in senses)


def words_of(joint: Joint) -> str:
    """Phrase that names combined misreadings, for the messages of a fit."""
    turned = [each.words for each in joint if each in SENSES]
    others = [each.words for each in joint if each not in SENSES]
    listed = " and ".join(filter(None, (", ".join(turned[:-1]), *turned[-1:])))
    return ", and ".join([*([f"{listed} counted against the rotation"] if turned else []), *others])
