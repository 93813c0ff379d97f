"""What a file of measurements says, in SI, with the lines that it stands on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ringbalance.scene.arrays import ComplexArray, FloatArray, IntArray, StringArray
from ringbalance.scene.uncertain import NORMAL_95


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

    def rows_of(self, values: FloatArray) -> FloatArray:
        """Values of `measured`, one row of numbers for each row of the file, shape (n, 1) or (n, 2)."""
        return np.reshape(values, (-1, len(self))).T

    def vectors(self, *, when: str = "") -> ComplexArray:
        """a exp(j phase) of each row, m zero to peak. Args: `when`: "", "_before" or "_after"."""
        columns = self.columns
        return np.asarray(
            columns[f"amplitude{when}"] * np.exp(1j * columns[f"phase{when}"]), dtype=np.complex128
        )

    def vector_covariance(self, *, when: str = "", given: bool) -> FloatArray:
        """Covariance of each vector's two parts, shape (n, 2, 2): m^2, or unit where noise is not `given`.

        Along the vector sigma_a, across it sigma_a or, where given, a sigma_phase.
        """
        count, widths = len(self), self.uncertainty
        if not given:
            return np.broadcast_to(np.eye(2), (count, 2, 2)).copy()
        along = widths[f"amplitude{when}"] / NORMAL_95
        size, across = self.columns[f"amplitude{when}"], along
        if f"phase{when}" in widths:
            across = np.where(size > 0, size * widths[f"phase{when}"] / NORMAL_95, along)
        angle = self.columns[f"phase{when}"]
        c, s, a, b = np.cos(angle), np.sin(angle), along**2, across**2
        return np.moveaxis(
            np.array([[a * c**2 + b * s**2, (a - b) * c * s], [(a - b) * c * s, a * s**2 + b * c**2]]), -1, 0
        )
