"""Where a run stops to mean anything: the loop diverges and its numbers grow without bound."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.eccentric_mass.run_loop import Record
from ringbalance.scene.arrays import BoolArray
from ringbalance.scene.eccentric_models import EccentricScene

LARGEST_WHIRL: Final = 1e3
"""Of the masses' own track.  The plant is linear in the displacement, which no bearing is far below this."""
LARGEST_TURN: Final = 1e3
"""Of a mass within one sample, rad: more than a hundred turns, which no sampled loop controls."""
LARGEST: Final = 1e100
"""Of any number, whatever its unit, so that squares and products of what is kept are finite."""


def rows(record: Record, count: int) -> Record:
    """The first rows of a record.

    Args: `record`: of a run. `count`: of the samples wanted.
    Returns: Record of views.
    """
    return _cut(record, slice(count))


def meaningful(record: Record, scene: EccentricScene, *, since: int = 0) -> Record:
    """The rows before the first that has diverged.

    Args: `record`: of a run. `since`: number of the first row to be looked at.
    Returns: The record when nothing in it has diverged; else a shorter one, of at least one row: at the start
        everything rests.
    """
    bad = np.flatnonzero(_diverged(_cut(record, slice(since, None)), scene))
    return rows(record, max(since + int(bad[0]), 1)) if bad.size else record


def _cut(record: Record, part: slice) -> Record:
    return Record._make(values[part] for values in record)


def _diverged(record: Record, scene: EccentricScene) -> BoolArray:
    state = record.state
    whirl = np.max(np.abs(state[:, :2]), axis=1)
    turn = np.max(np.abs(state[:, 6:8]), axis=1) * scene.sensor.step
    # A comparison with NaN is false.
    usual = (whirl <= LARGEST_WHIRL * scene.masses.guide_radius) & (turn <= LARGEST_TURN)
    for values in record:
        if values.dtype == np.float64:
            usual &= np.all(np.abs(values.reshape(len(values), -1)) <= LARGEST, axis=1)
    return np.asarray(~usual)
