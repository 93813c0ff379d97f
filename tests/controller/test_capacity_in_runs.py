"""Capacity against runs that stall: where short injections leave a chamber, and what is printed."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Final

import numpy as np
import pytest

import ringbalance
from ringbalance.controller.simulation import Outcome, Simulation
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import liquid_ring_scene

NEAR: Final = 0.0025
"""Fill by which a run may stop elsewhere: half of one injection, a fiftieth of a fill of 0.25."""


def driven(scene: Scene, calibration: Calibration, *, share: float) -> Simulation:
    """A run against an unbalance in the worst direction, in injections of a fiftieth of a chamber's volume.

    Chambers that have nothing to give leave their share to others: the worst direction is across a pair.
    Args: `share`: of the unbalance over what a pair can form by geometry.
    """
    rotor, disc = scene.rotor, scene.disc
    law, start = calibration.flow_law, disc.initial_fill
    flow = law.evaluate(
        fill_ratio=start, opposite_fill_ratio=start, gas_pressure=scene.gas.pressure, primed=True
    )
    # Each injection fills the tube up to the crest before any liquid passes.
    moved = 0.02 * start * calibration.chamber.volume + 0.5 * scene.tube.length * scene.tube.area
    longest = moved / (scene.tube.area * float(flow.velocity))
    amplitude = share * float(calibration.answers.moment) * rotor.influence_coefficient
    changed = scene.with_values(
        {
            "rotor.initial_vibration": {"amplitude": amplitude, "phase": math.pi / 2 - rotor.lag_angle},
            "sensor.amplitude_noise": 0.0,
            "sensor.phase_noise": 0.0,
            "controller.proportional": 25 * longest / amplitude,
            "controller.integral_time": None,
            "controller.derivative_time": 0.0,
            "controller.maximum_gas_time": longest,
            "controller.minimum_gas_time": 1e-3 * longest,
            "controller.limit": 1e-3 * amplitude,
            "run.time_limit": 1000.0,
        }
    )
    return ringbalance.simulate(changed, flow_law=law)


@pytest.mark.parametrize("pressure", [0.45e6, 0.5e6, 0.55e6, 0.7e6, 1.0e6])
def test_a_chamber_empties_to_the_printed_fill(paper_scene: Scene, pressure: float) -> None:
    scene = paper_scene.with_values({"gas.pressure": pressure})
    result = ringbalance.calibrate(scene)
    # More than the gas can do at the lower pressures, than the disc can do at the others.
    stalls = pressure < 0.51e6
    run = driven(scene, result, share=0.85 if stalls else 0.95)
    assert run.outcome is (Outcome.STALLED if stalls else Outcome.CAPACITY_EXCEEDED)
    judged(run, result)


def judged(run: Simulation, found: Calibration) -> None:
    """A run ends where the calibration says: the fill, and what the moment of all pairs takes away."""
    rest, kappa = found.answers, run.scene.rotor.influence_coefficient
    assert min(float(fill.min()) for fill in run.fill_ratio.values()) == pytest.approx(
        rest.least_fill_ratio, abs=NEAR
    )
    moved = (float(run.amplitude[0]) - float(run.amplitude[-1])) / kappa
    per_fill = rest.moment / run.scene.disc.initial_fill
    assert moved == pytest.approx(
        rest.reach, abs=float(1.1 * NEAR * per_fill * rest.reach / rest.usable_moment)
    )


def random_scene(folder: Path, number: int) -> Scene:
    """A disc of any proportions, with gas that about half of the time stalls before a chamber is empty."""
    random = np.random.default_rng([27, number])
    chambers = int(random.choice([4, 6, 8]))
    outer = random.uniform(30e-3, 90e-3)
    inner = random.uniform(0.4, 0.6) * outer
    crest = inner + random.uniform(0.2, 0.5) * (outer - inner)
    omega, rho = random.uniform(3000, 12000) * math.pi / 30, random.uniform(800, 2000)
    pressure = random.uniform(0.75, 1.3) * rho * omega**2 * (outer**2 - crest**2) / 2
    length = 2 * math.sqrt(outer**2 - crest**2) + crest * (math.pi - 2 * math.acos(crest / outer))
    text = f"""
[disc]
outer_radius = "{outer} m"
inner_radius = "{inner} m"
axial_width = "{random.uniform(40e-3, 80e-3)} m"
central_angle = "{0.9 * 360 / chambers} deg"
chambers = {chambers}
[liquid]
density = "{rho} kg/m^3"
kinematic_viscosity = "{10 ** random.uniform(-6.3, -5.7)} m^2/s"
vapour_pressure = "2 kPa"
[tube]
bore = "{random.uniform(1e-3, 1.6e-3)} m"
hump_radius = "{crest} m"
length = "{1.1 * length} m"
[gas]
pressure = "{pressure} Pa"
[rotor]
speed = "{omega} rad/s"
"""
    path = folder / "disc.toml"
    path.write_text(text)
    return liquid_ring_scene(ringbalance.load_scene(path))


@pytest.mark.parametrize("number", range(10))
def test_capacity_and_runs_agree_on_random_discs(tmp_path: Path, number: int) -> None:
    scene = random_scene(tmp_path, number)
    result = ringbalance.calibrate(scene)
    usable = float(result.answers.usable_moment / result.answers.moment)
    run = driven(
        scene, result, share=1.1 * usable * float(result.answers.reach / result.answers.usable_moment)
    )
    judged(run, result)


def test_a_stalled_run_names_the_pressure_from_which_injections_begin(paper_scene: Scene) -> None:
    """Each short injection begins over an empty crest, so its pressure is that of priming."""
    scene = paper_scene.with_values({"gas.pressure": 0.45e6, "rotor.initial_vibration.amplitude": "9 um"})
    run = ringbalance.simulate(scene)
    assert run.outcome is Outcome.STALLED
    (named,) = re.findall(r"to empty it: ([0-9.]+) MPa", run.status)
    priming = ringbalance.calibrate(scene).quantities["priming_pressure_vented"].value
    assert priming is not None
    assert float(named) == pytest.approx(1e-6 * priming, rel=2e-3)
