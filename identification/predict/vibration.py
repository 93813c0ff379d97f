"""Measured vibrations as vectors, and how their errors hang together."""

from __future__ import annotations

import numpy as np

from ringbalance.identification.data.observations import Observations
from ringbalance.scene.arrays import ComplexArray, FloatArray
from ringbalance.scene.uncertain import NORMAL_95


def vectors(observations: Observations, *, when: str = "") -> ComplexArray:
    """a exp(j phase) of each row, m zero to peak. Args: `when`: "", "_before" or "_after"."""
    columns = observations.columns
    return np.asarray(columns[f"amplitude{when}"] * np.exp(1j * columns[f"phase{when}"]), dtype=np.complex128)


def parts(vector: ComplexArray) -> FloatArray:
    """Real parts, then imaginary parts, shape (2 n,)."""
    return np.concatenate([vector.real, vector.imag])


def vector_covariance(observations: Observations, *, when: str = "", given: bool) -> FloatArray:
    """Covariance of each vector's two parts, shape (n, 2, 2): m^2, or unit where the noise is not `given`.

    Along the vector sigma_a, across it sigma_a or, where given, a sigma_phase.
    """
    count, widths = len(observations), observations.uncertainty
    if not given:
        return np.broadcast_to(np.eye(2), (count, 2, 2)).copy()
    along = widths[f"amplitude{when}"] / NORMAL_95
    size, across = observations.columns[f"amplitude{when}"], along
    if f"phase{when}" in widths:
        across = np.where(size > 0, size * widths[f"phase{when}"] / NORMAL_95, along)
    angle = observations.columns[f"phase{when}"]
    c, s, a, b = np.cos(angle), np.sin(angle), along**2, across**2
    return np.moveaxis(
        np.array([[a * c**2 + b * s**2, (a - b) * c * s], [(a - b) * c * s, a * s**2 + b * c**2]]), -1, 0
    )


def spread_out(blocks: FloatArray) -> FloatArray:
    """Covariance of `parts` of vectors that are independent of each other, shape (2 n, 2 n)."""
    count = blocks.shape[0]
    full, i = np.zeros((2 * count, 2 * count)), np.arange(count)
    for row in range(2):
        for column in range(2):
            full[row * count + i, column * count + i] = blocks[:, row, column]
    return full
