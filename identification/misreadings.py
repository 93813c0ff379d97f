"""Ways to misread a file of measurements: one after another, and senses of angles and amplitudes together."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Final

import numpy as np

from ringbalance.controller.rotor import chamber_letters
from ringbalance.identification.kinds.kind import Observations
from ringbalance.scene.arrays import FloatArray

_LONGEST_TIME: Final = 10.0
"""s, of an injection: seconds are looked for where milliseconds stand, and not hours."""
Change = Callable[[Observations, Any], Observations | None]
"""Takes the scene, too, which kinds of one balancer alone ask for a value of that balancer."""


@dataclass(frozen=True, kw_only=True)
class Misreading:
    """One way to misread a file."""

    code: str
    words: str
    change: Change
    settings: bool
    """Whether it changes what was set, and so what is predicted."""
    scale: float = 1.0
    """dy'/dy."""
    column: str = ""
    """That it changes, where the scene has a range of it."""
    together: bool = True
    """Whether all files may have been misread alike."""


def _exchanged(observations: Observations, _: Any) -> Observations | None:
    """Columns of before and after, with their uncertainties."""
    if observations.kind != "injection":
        return None
    other = {"before": "after", "after": "before"}

    def swapped(values: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        named = {n: n.rsplit("_", 1) for n in values}
        return {
            f"{named[n][0]}_{other[named[n][1]]}" if named[n][-1] in other else n: v
            for n, v in values.items()
        }

    return replace(
        observations,
        columns=swapped(observations.columns),
        uncertainty=swapped(observations.uncertainty),
    )


def _turned(*names: str) -> Change:
    """Angles of these names with the other sign."""

    def change(observations: Observations, _: Any) -> Observations | None:
        chosen = {n: -v for n, v in observations.columns.items() if n.startswith(names)}
        vibration = any(n.startswith("phase") for n in observations.columns)
        return observations.with_columns(**chosen) if chosen and vibration else None

    return change


def _lettered(observations: Observations, scene: Any) -> Observations | None:
    """Chambers counted against the rotation from A."""
    if observations.kind != "injection" or scene.disc.chambers < 4:
        return None
    letters = chamber_letters(scene.disc.chambers)
    count = len(letters)
    numbers = [letters.index(letter) for letter in observations.chamber]
    return replace(observations, chamber=np.array([letters[-i % count] for i in numbers]))


def _amplitudes(factor: float) -> Change:
    def change(observations: Observations, _: Any) -> Observations | None:
        columns = {n: factor * v for n, v in observations.columns.items() if n.startswith("amplitude")}
        widths = {n: factor * v if n in columns else v for n, v in observations.uncertainty.items()}
        return replace(observations.with_columns(**columns), uncertainty=widths) if columns else None

    return change


def _pressures(factor: float, *, absolute: bool = False) -> Change:
    """Of the gas, in another unit, or less that of the surroundings."""

    def change(observations: Observations, scene: Any) -> Observations | None:
        if observations.kind not in ("injection", "transfer"):
            return None
        gauge = factor * observations.columns["pressure"]
        gauge = gauge - scene.gas.ambient_pressure if absolute else gauge
        return observations.with_columns(pressure=gauge) if np.all(gauge > 0) else None

    return change


def _seconds(observations: Observations, _: Any) -> Observations | None:
    if observations.kind not in ("injection", "transfer"):
        return None
    times = 1e3 * observations.columns["gas_time"]
    return observations.with_columns(gas_time=times) if np.median(times) < _LONGEST_TIME else None


SENSES: Final = (
    Misreading(code="phases_turned", words="phases", change=_turned("phase"), settings=False),
    Misreading(
        code="weights_turned", words="angles of the trial weights", change=_turned("angle"), settings=True
    ),
    Misreading(code="chambers_turned", words="letters of the chambers", change=_lettered, settings=True),
)
"""Of angles against the rotation, alone and together."""
AMPLITUDES: Final = tuple(
    Misreading(code=code, words=words, change=_amplitudes(factor), settings=False, scale=factor)
    for code, factor, words in (
        (
            "amplitudes_halved",
            0.5,
            "amplitudes half as large, such as peak to peak stated as zero to peak",
        ),
        (
            "amplitudes_doubled",
            2.0,
            "amplitudes twice as large, such as zero to peak stated as peak to peak",
        ),
        (
            "amplitudes_over_root_two",
            math.sqrt(0.5),
            "amplitudes 0.71 times as large, such as zero to peak stated as rms",
        ),
        (
            "amplitudes_times_root_two",
            math.sqrt(2.0),
            "amplitudes 1.41 times as large, such as rms stated as zero to peak",
        ),
    )
)
"""Alone and with every sense of the angles."""
_OTHERS: Final = (
    Misreading(
        code="before_and_after_exchanged",
        words="vibrations before and after exchanged",
        change=_exchanged,
        settings=False,
        together=False,
    ),
    Misreading(
        code="pressures_tenth",
        words="gas pressures a tenth as large, such as bar stated as MPa",
        change=_pressures(0.1),
        settings=True,
        column="pressure",
    ),
    Misreading(
        code="pressures_tenfold",
        words="gas pressures ten times as large, such as MPa stated as bar",
        change=_pressures(10.0),
        settings=True,
        column="pressure",
    ),
    Misreading(
        code="pressures_absolute",
        words="gas pressures as absolute ones, less that of the surroundings",
        change=_pressures(1.0, absolute=True),
        settings=True,
        column="pressure",
    ),
    Misreading(
        code="times_in_seconds",
        words="valve-open times a thousand times as long, such as seconds stated as milliseconds",
        change=_seconds,
        settings=True,
        column="gas_time",
    ),
)
"""Alone."""
Joint = tuple[Misreading, ...]


def joint_misreadings() -> Iterator[Joint]:
    """Misreadings that may have been made together, the simplest first."""
    yield from ((each,) for each in _OTHERS)
    senses = [chosen for n in range(len(SENSES) + 1) for chosen in combinations(SENSES, n)]
    yield from senses[1:]
    yield from ((*chosen, each) for each in AMPLITUDES for chosen in senses)


def words_of(joint: Joint) -> str:
    """Phrase that names misreadings that were made together, for the advice of a fit."""
    turned = [each.words for each in joint if each in SENSES]
    others = [each.words for each in joint if each not in SENSES]
    listed = " and ".join(filter(None, (", ".join(turned[:-1]), *turned[-1:])))
    return ", and ".join([*([f"{listed} counted against the rotation"] if turned else []), *others])
