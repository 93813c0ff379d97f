"""Runs of drawn devices with two eccentric masses, packed for the page that replays them."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Callable
from typing import Any, Final, cast

import numpy as np

from ringbalance.controller.balancer import AS_GIVEN, Draws
from ringbalance.controller.eccentric_mass.balancer import EccentricMassBalancer
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.run import locked_run
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE
from ringbalance.scene.arrays import FloatArray, IntArray

DEVICES: Final = 16
"""Number of drawn devices that are replayed."""
INSTANTS: Final = 700
"""Number of instants of a run on the page: with sixteen devices 180 kB."""
_FULL_SCALE: Final = 32767
"""Largest whole number of an angle or a time."""


def replay_content(
    scene: EccentricScene, *, devices: int = DEVICES, progress: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """Numbers and texts of a page that replays runs, for JSON.

    Args: `devices`: number of drawn devices, the first of those that `tune` judges. `progress`: called with a
        text.
    """
    balancer, runs, packed = EccentricMassBalancer(scene), list[dict[str, Any]](), b""
    progress("run without balancing ...")
    locked = locked_run(scene)
    for number in range(-1, devices):
        progress(f"device {number + 1} of {devices} ...")
        # One at a time, since each sample of a run is in memory.
        draws = AS_GIVEN if number < 0 else Draws.block(FIRST_VERDICT_DEVICE + number, 1)
        run = cast(EccentricRun, balancer.run({}, draws, trace=True).traced[0].run)
        facts, numbers = _packed(run, _instants(run))
        runs.append(facts)
        packed += numbers
    facts, numbers = _packed(locked, _instants(locked))
    return {
        "name": scene.name,
        "limit": scene.supervisor.limit,
        "profile": [np.asarray(each).tolist() for each in scene.rotor.profile],
        "runs": [*runs, facts],
        "numbers": b64encode(zlib.compress(packed + numbers, 9)).decode("ascii"),
    }


def _instants(run: EccentricRun) -> IntArray:
    """Samples that are kept, dense where angles or the vibration change, with the edges of the stages and the
    largest vibration."""
    amplitude = np.log(np.maximum(run.amplitude, 0.03 * run.limit))
    parts = [np.abs(np.diff(values)) for values in (run.time, amplitude, *run.mass_angle)]
    change = sum(part / part.sum() for part in parts if part.any())
    path = np.concatenate([[0.0], np.cumsum(change)])
    even = np.searchsorted(path, np.linspace(0, path[-1], INSTANTS))
    edges = np.searchsorted(run.time, [stage.start for stage in run.stages])
    ends = np.array([0, int(np.argmax(run.amplitude)), len(path) - 1])
    return np.unique(np.concatenate([even, edges, ends]).clip(0, len(path) - 1))


def _packed(run: EccentricRun, samples: IntArray) -> tuple[dict[str, Any], bytes]:
    """Facts of a run, and its instants: times and angles as whole numbers, the rest as half precision.

    Order: time; angle of each mass; x and y of the vibration over the limit; torque of each motor over the
    largest of the run. Torques are the largest between an instant and the next.
    """
    plant = PlantParameters.of(run.scene)
    torque = plant.drive_gain * run.voltage - plant.drive_damping * run.mass_rate
    most_torque = float(np.abs(torque).max()) or 1.0
    angles = run.mass_angle[:, samples]
    middle = (angles.max(axis=1) + angles.min(axis=1)) / 2
    half = np.maximum(np.ptp(angles, axis=1) / 2, 1e-3)
    end = run.end or 1.0
    integers = [run.time[samples] / end, *((angles - middle[:, None]) / half[:, None])]
    whirl = run.whirl[samples] / run.limit
    halves = [whirl.real, whirl.imag, *(_peaks(each, samples) / most_torque for each in torque)]
    facts = {
        "count": len(samples),
        "end": end,
        "middle": middle.tolist(),
        "half": half.tolist(),
        "torque": most_torque,
        "moment": plant.moment,
        "unbalance": [
            plant.unbalance * float(np.cos(plant.phase)),
            plant.unbalance * float(np.sin(plant.phase)),
        ],
        "stages": [[each.name, each.start] for each in run.stages],
        "settled": run.settling_time,
        "status": f"{run.status[:1].upper()}{run.status[1:].replace(' um', ' µm')}.",
    }
    numbers = [np.round(_FULL_SCALE * each).astype("<i2") for each in integers]
    return facts, b"".join(each.tobytes() for each in [*numbers, *(each.astype("<f2") for each in halves)])


def _peaks(values: FloatArray, samples: IntArray) -> FloatArray:
    """Values of the largest magnitude from each sample to before the next."""
    high, low = np.maximum.reduceat(values, samples), np.minimum.reduceat(values, samples)
    return np.where(high > -low, high, low)
