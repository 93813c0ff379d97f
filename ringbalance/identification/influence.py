"""Influence coefficients over speed from a file of a rotordynamics program or a run-up.

The file must state its conventions, since programs differ in sign and in the definition of an amplitude;
nothing is guessed.  Between its speeds W the dynamic stiffness W^2/H is interpolated.  For a Jeffcott rotor
it is a parabola, also through the critical speed, where H itself reverses within a few percent of the speed.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.identification.tables import (
    data_fault,
    decoded,
    file_name,
    parse_table,
    read_content,
    split_head,
)
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.faults import SceneError

_AMPLITUDES: Final = {"zero-to-peak": 1.0, "peak-to-peak": 0.5, "rms": math.sqrt(2.0)}
"""Factor to a zero-to-peak amplitude, by convention."""
_SIGNS: Final = {"lag": -1.0, "lead": 1.0, "exp(+jwt)": 1.0, "exp(-jwt)": -1.0}
"""Factor on an angle or an imaginary part, by convention; the result is positive ahead of the unbalance."""
_POLAR: Final = ("amplitude", "angle")
_CARTESIAN: Final = ("real", "imaginary")
_DIMENSIONS: Final = {
    "speed": "speed",
    "amplitude": "influence_coefficient",
    "angle": "angle",
    "real": "influence_coefficient",
    "imaginary": "influence_coefficient",
}
_NEAREST: Final = 4
"""Number of points of the interpolating polynomial."""
_EXAMPLE: Final = '# vibration = "zero-to-peak"'


@dataclass(frozen=True, kw_only=True, eq=False)
class InfluenceTable:
    """Vibration per unbalance over speed, in one plane.

    Example:
        >>> lines = ['# vibration = "zero-to-peak"', '# angle = "lag"']
        >>> lines += ["speed [rpm],amplitude [um/(g*mm)],angle [deg]", "5000,0.0191,4.1"]
        >>> lines += ["6000,0.0312,8.9", "7000,0.0518,31.0", "8000,0.0367,140.2"]
        >>> characters = Path("influence.csv").write_text("\\n".join(lines))
        >>> table: rb.InfluenceTable = rb.read_influence("influence.csv")
        >>> "rotor.lag_angle" in table.rotor(6500 * math.pi / 30)
        True
    """

    source: str
    speed: FloatArray
    """Speeds, rad/s, ascending, shape (n,), n at least 2."""
    coefficient: ComplexArray
    """H, m/(kg m), zero-to-peak; its argument is positive if the vibration leads the unbalance."""

    def at(self, speed: float) -> complex:
        """H at a speed, rad/s.

        Polynomial of W^2/H through the four nearest speeds; its error shows if one speed is left out.
        Raises: ValueError: a speed outside the table.
        """
        if not self.speed[0] <= speed <= self.speed[-1]:
            ends = f"{self.speed[0]:g} to {self.speed[-1]:g} rad/s"
            raise ValueError(f"{self.source} has influence coefficients for {ends}, not for {speed:g} rad/s")
        first = int(np.searchsorted(self.speed, speed)) - _NEAREST // 2
        first = max(min(first, self.speed.size - _NEAREST), 0)
        x = self.speed[first : first + _NEAREST]
        stiffness = x**2 / self.coefficient[first : first + _NEAREST]
        others = [np.delete(x, point) for point in range(x.size)]
        weights = [np.prod((speed - rest) / (node - rest)) for node, rest in zip(x, others, strict=True)]
        return complex(speed**2 / np.dot(weights, stiffness))

    def rotor(self, speed: float) -> dict[str, object]:
        """Influence coefficient, m/(kg m), and lag angle, rad, at a speed, rad/s, for `scene.with_values`.

        Raises: ValueError: a speed outside the table.
        """
        value = self.at(speed)
        return {"rotor.influence_coefficient": abs(value), "rotor.lag_angle": -cmath.phase(value)}


def read_influence(path: Path | str) -> InfluenceTable:
    """Read influence coefficients over speed.

    First lines, each behind #: `vibration` = "zero-to-peak", "peak-to-peak" or "rms"; with the columns
    `amplitude` and `angle` also `angle` = "lag" (it grows as the vibration falls behind) or "lead",
    with `real` and `imaginary` also `convention` = "exp(+jwt)" (a lagging vibration has a negative imaginary
    part) or "exp(-jwt)". Columns carry their units: `speed [rpm]`, `amplitude [um/(g*mm)]`, `angle [deg]`.

    Raises: SceneError: every error of the file.

    Example:
        >>> lines = ['# vibration = "zero-to-peak"', '# angle = "lag"']
        >>> lines += ["speed [rpm],amplitude [um/(g*mm)],angle [deg]", "5000,0.0191,4.1"]
        >>> lines += ["6000,0.0312,8.9", "7000,0.0518,31.0", "8000,0.0367,140.2"]
        >>> characters = Path("influence.csv").write_text("\\n".join(lines))
        >>> table = rb.read_influence("influence.csv")
        >>> sorted(table.rotor(6500 * math.pi / 30))
        ['rotor.influence_coefficient', 'rotor.lag_angle']
    """
    file = file_name(Path(path))
    content, faults = read_content(Path(path))
    text, more = decoded(content, file=file) if not faults else ("", ())
    table, further = parse_table(text, file=file) if not (faults or more) else (None, ())
    if table is None or faults or more or further:
        raise SceneError([*faults, *more, *further])
    heads = {split[0]: (head, split[1]) for head in table.heads if (split := split_head(head))}
    cartesian = "real" in heads
    columns = ("speed", *(_CARTESIAN if cartesian else _POLAR))
    sign_key = "convention" if cartesian else "angle"
    signs = ("exp(+jwt)", "exp(-jwt)") if cartesian else ("lag", "lead")
    wrong, values = [], {}
    for name in columns:
        if name not in heads:
            problem = f'there is no column "{name}"'
            allowed = "speed with amplitude and angle, or speed with real and imaginary, each with its unit"
            wrong.append(data_fault(file, f"line {table.head_line}", problem, allowed=allowed))
    for key, words in (("vibration", tuple(_AMPLITUDES)), (sign_key, signs)):
        if table.header.get(key) not in words:
            value = "" if key not in table.header else repr(table.header[key])
            problem = f"the file does not say what its numbers mean, such as {_EXAMPLE}"
            wrong.append(data_fault(file, key, problem, value=value, allowed=" or ".join(words)))
    for name in columns if not wrong else ():
        head, unit = heads[name]
        values[name], bad = table.values(head, unit, _DIMENSIONS[name])
        wrong += bad
    if wrong:
        raise SceneError(wrong)
    sign, factor = _SIGNS[str(table.header[sign_key])], _AMPLITUDES[str(table.header["vibration"])]
    first, second = (values[name] for name in columns[1:])
    phasor = first + 1j * sign * second if cartesian else first * np.exp(1j * sign * second)
    order = np.argsort(values["speed"])
    speed, coefficient = values["speed"][order], np.asarray(factor * phasor, dtype=np.complex128)[order]
    if speed.size < 2 or np.any(np.diff(speed) <= 0.0) or speed[0] <= 0.0 or np.any(coefficient == 0.0):
        problem = "no table of vibrations over speeds"
        allowed = "two speeds or more, each once, none of them zero"
        raise SceneError([data_fault(file, "", problem, allowed=allowed)])
    return InfluenceTable(source=file, speed=speed, coefficient=coefficient)
