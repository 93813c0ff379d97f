"""Change of the vibration by injections, V_after - V_before = K [M(x_after) - M(x_before)] e_pair.

M is the moment of the pair of chambers that the gas acts on, e its direction.  The fills of a series follow
from one injection to the next, from the scene's initial fill, unless a row states that of its chamber.
Source: Eqs. 21 to 23 of the liquid-ring paper with the program's own law and moments.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.controller.rotor import chamber_directions, chamber_letters
from ringbalance.identification.data.measurements import Observations
from ringbalance.identification.predict.device import Device, Models, runs_back
from ringbalance.identification.predict.predicted import PredictedKind, always, parts, spread_out
from ringbalance.scene.arrays import FloatArray, IntArray
from ringbalance.scene.models import Scene


def _measured(observations: Observations) -> FloatArray:
    """Changes of the vibration, real and then imaginary parts, m, shape (2 n,)."""
    return parts(observations.vectors(when="_after") - observations.vectors(when="_before"))


def _predict(scene: Scene, observations: Observations, models: Models) -> FloatArray:
    """The same by the scene's law. Raises: ValueError: as `_chamber_numbers`."""
    device = Device.of(scene, models)
    before, after = device.once(observations, _fills)
    total = 2 * scene.disc.initial_fill
    pair = _chamber_numbers(scene, observations) % (scene.disc.chambers // 2)
    law = device.law.moment
    moved = law.pair_vector(fill_ratio=after, opposite_fill_ratio=total - after) - law.pair_vector(
        fill_ratio=before, opposite_fill_ratio=total - before
    )
    k = scene.rotor.influence
    return parts(k * scene.disc.moment_factor * moved * chamber_directions(scene.disc.chambers)[pair])


def _chamber_numbers(scene: Scene, observations: Observations) -> IntArray:
    """Index of the driven chamber of each row. Raises: ValueError: a letter that the disc does not have."""
    letters = chamber_letters(scene.disc.chambers)
    for line, letter in zip(observations.lines, observations.chamber, strict=True):
        if letter not in letters:
            raise ValueError(
                f'{observations.file}: line {line}, column "chamber": "{letter}" is no chamber of the scene; '
                f"allowed: {', '.join(letters)}"
            )
    return np.array([letters.index(letter) for letter in observations.chamber], dtype=np.int64)


def _fills(device: Device, observations: Observations) -> FloatArray:
    """Fill of the positive chamber of each row's pair before and after, shape (2, n)."""
    disc, columns = device.scene.disc, observations.columns
    chambers = _chamber_numbers(device.scene, observations)
    half, total = disc.chambers // 2, 2 * disc.initial_fill
    now: dict[tuple[str, int], float] = {}
    found = np.empty((2, len(observations)))
    stated = columns.get("fill_ratio")
    for i, number in enumerate(chambers.tolist()):
        place = str(observations.series[i]), number % half
        if stated is not None:
            x = min(float(stated[i]), total)
            now[place] = x if number < half else total - x
        found[0, i] = now.get(place, disc.initial_fill)
        found[1, i] = device.injected(
            fill=found[0, i],
            chamber=number // half,
            pressure=float(columns["pressure"][i]),
            gas_time=float(columns["gas_time"][i]),
        )
        now[place] = found[1, i]
    return found


def _covariance(observations: Observations) -> FloatArray:
    """Of the measured parts, shape (2 n, 2 n); in units of one vector's where the noise is not given.

    A vibration that stands as that after one injection and that before the next one of its series was
    measured once: its error enters both changes, with opposite signs.
    """
    before, after = (
        observations.vector_covariance(when=when, given=_noise_given(observations))
        for when in ("_before", "_after")
    )
    full = spread_out(before + after)
    count = len(observations)
    for later, earlier in _shared_readings(observations):
        for row in range(2):
            for column in range(2):
                value = -after[earlier, row, column]
                full[row * count + later, column * count + earlier] = value
                full[column * count + earlier, row * count + later] = value
    return full


def _noise_given(observations: Observations) -> bool:
    """Whether both vibrations of a row have their uncertainty."""
    return {"amplitude_before", "amplitude_after"} <= set(observations.uncertainty)


def _shared_readings(observations: Observations) -> list[tuple[int, int]]:
    """Rows whose vibration before is that after the row above in their series, digit for digit."""
    before, after = (observations.vectors(when=when) for when in ("_before", "_after"))
    last: dict[str, int] = {}
    found = []
    for i, series in enumerate(observations.series.tolist()):
        if series in last and before[i] == after[last[series]]:
            found.append((i, last[series]))
        last[series] = i
    return found


INJECTION: Final = PredictedKind(
    predict=_predict,
    measured=_measured,
    covariance=_covariance,
    noise_given=_noise_given,
    column=lambda _: "amplitude_after",
    informs=always("lambda_factor", "bore", "extra_loss"),
    obstacle=runs_back,
)
