"""Ways to misread a file of measurements: columns exchanged, angles the other way round, units mixed up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
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


def _with(observations: Observations, **columns: FloatArray) -> Observations:
    return replace(observations, columns={**observations.columns, **columns})


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
        return _with(observations, **chosen) if chosen and vibration else None

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
        return replace(_with(observations, **columns), uncertainty=widths) if columns else None

    return change


def _pressures(factor: float, *, absolute: bool = False) -> Change:
    """Of the gas, in another unit, or less that of the surroundings."""

    def change(observations: Observations, scene: Any) -> Observations | None:
        if observations.kind not in ("injection", "transfer"):
            return None
        gauge = factor * observations.columns["pressure"]
        gauge = gauge - scene.gas.ambient_pressure if absolute else gauge
        return _with(observations, pressure=gauge) if np.all(gauge > 0) else None

    return change


def _seconds(observations: Observations, _: Any) -> Observations | None:
    if observations.kind not in ("injection", "transfer"):
        return None
    times = 1e3 * observations.columns["gas_time"]
    return _with(observations, gas_time=times) if np.median(times) < _LONGEST_TIME else None


MISREADINGS: Final[Mapping[str, Misreading]] = {
    "before_and_after_exchanged": Misreading(
        words="vibrations before and after exchanged", change=_exchanged, settings=False, together=False
    ),
    "phases_turned": Misreading(
        words="phases with the other sign, against the rotation", change=_turned("phase"), settings=False
    ),
    "weights_turned": Misreading(
        words="angles of the trial weights against the rotation", change=_turned("angle"), settings=True
    ),
    "chambers_turned": Misreading(
        words="chambers lettered against the rotation", change=_lettered, settings=True
    ),
    "amplitudes_halved": Misreading(
        words="amplitudes half as large, such as peak to peak stated as zero to peak",
        change=_amplitudes(0.5),
        settings=False,
        scale=0.5,
    ),
    "amplitudes_doubled": Misreading(
        words="amplitudes twice as large, such as zero to peak stated as peak to peak",
        change=_amplitudes(2.0),
        settings=False,
        scale=2.0,
    ),
    "pressures_tenth": Misreading(
        words="gas pressures a tenth as large, such as bar stated as MPa",
        change=_pressures(0.1),
        settings=True,
        column="pressure",
    ),
    "pressures_tenfold": Misreading(
        words="gas pressures ten times as large, such as MPa stated as bar",
        change=_pressures(10.0),
        settings=True,
        column="pressure",
    ),
    "pressures_absolute": Misreading(
        words="gas pressures as absolute ones, less that of the surroundings",
        change=_pressures(1.0, absolute=True),
        settings=True,
        column="pressure",
    ),
    "times_in_seconds": Misreading(
        words="valve-open times a thousand times as long, such as seconds stated as milliseconds",
        change=_seconds,
        settings=True,
        column="gas_time",
    ),
}
"""By code."""
