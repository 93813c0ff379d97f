"""What a file of measurements says, in SI, with the lines that it stands on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ringbalance.scene.arrays import FloatArray, IntArray, StringArray


@dataclass(frozen=True, kw_only=True)
class Observations:
    """The rows of one file of measurements, all of one kind."""

    kind: str
    file: str
    source: str = ""
    """Rig, run and date, as the file's first lines have them."""
    sha256: str = ""
    """Of the file's bytes."""
    lines: IntArray
    """Line of each row in the file, from 1."""
    series: StringArray
    """Run, rig or day that a row belongs to."""
    chamber: StringArray
    """Letter of the driven chamber; empty where the kind has none."""
    columns: Mapping[str, FloatArray]
    """SI, by name; amplitudes zero to peak. An optional column that the file does not have is absent."""
    uncertainty: Mapping[str, FloatArray]
    """Expanded (95 %), absolute, SI, by measured column; where one is absent its noise is estimated."""

    def __len__(self) -> int:
        return int(self.lines.size)
