"""Noisy closed-loop runs with all terms of an injection, compared with scipy's solve_ivp; growth with their
number.

    python benchmarks/closed_loop.py [--json] [--repeats 3] [--members 1000] [--largest 8000]

Both sides carry out the whole target-vector loop of the paper's disc under the calibrated law: noisy samples,
two valves a command, and the motion of every driven pair.  The rival is a plain user script: a Python loop
with the injections of `moving_injection`, solve_ivp with events, by the method and tolerance that is fastest
over the injections of a run among those that keep each fill within 1e-6.  The rival assumes that a pair is at
rest and vented at the next sample, keeps no record and ignores residual fills.  The program runs drawn
devices, each with its own law, rotor and noise, including the time to draw them, and does all that the rival
leaves out.  Before timing, runs without noise must agree; the error of their fills is printed.
Times are processor times of one thread, the least of several rounds; the growth is measured after everything
has been compiled, so that the peak memory of the process shows the memory of further devices.
"""

from __future__ import annotations

import argparse
import cmath
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from moving_injection import FILL_ERROR, METHODS, TOLERANCES, WANTED, Rival, least, ours, piped_scene

from ringbalance.controller.balancer import AS_GIVEN, Draws
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.liquid_ring.drawn_runs import RELATIVE_ERROR
from ringbalance.controller.terms import dynamics_of
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.injection.dynamics import Dynamics
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.terms import FILLING, HELD, INERTIA, LAG
from ringbalance.scene.models import Scene

GAIN = 0.3
"""Fraction of the paper's gain, which suits the paper's own law; the calibrated law moves more liquid."""
TIME_LIMIT = 20.0
"""Time limit of a run, s: some 40 samples."""
JUDGED = 20
"""Injections of a run by which the rival's method is chosen."""
RIVAL_RUNS = 2
END_ERROR = 1e-9
"""Largest error of a run's last amplitude, m: some of its fills are within 1e-6."""


FIRST_CALL = """
import time
from ringbalance.controller.balancer import AS_GIVEN, balancer_of
from ringbalance.scene.loader import bundled_scene, load_scene
balancer = balancer_of(load_scene(bundled_scene("liquid_ring_paper")), flow_law="paper")
start = time.process_time()
balancer.run({}, AS_GIVEN)
print(time.process_time() - start)
"""


@dataclass(kw_only=True)
class Carried:
    """Injections by solve_ivp for the plain loop, with a list of the requested ones."""

    rival: Rival
    total: float
    method: str = "LSODA"
    tolerance: float = 1e-8
    targets: list[tuple[float, float]] = field(default_factory=list)

    def operate(self, fill: float, duration: float) -> float:
        """Fill of the driven chamber at the next sample."""
        self.targets.append((fill, duration))
        return self.rival.inject(duration, method=self.method, tolerance=self.tolerance, fill=fill)


def plain_run(scene: Scene, model: BalancerModel, plain: Carried, seed: int) -> tuple[complex, int]:
    """One target-vector run by a plain loop.

    Args: `plain`: computes an injection. `seed`: of the noise.
    Returns: Vibration at the end, m, and the number of samples.
    """
    settings, sensor, random = scene.controller, scene.sensor, np.random.default_rng(seed)
    exact = sensor.amplitude_noise == sensor.phase_noise == 0
    fills = [scene.disc.initial_fill] * (scene.disc.chambers // 2)
    now, samples, integral = 0.0, 0, 0.0
    before: tuple[float, float, float] | None = None
    while True:
        v, z = _vibration(scene, model, fills, plain.total), random.standard_normal(2)
        amplitude = abs(abs(v) + sensor.amplitude_noise * z[0])
        phase = cmath.phase(v) + sensor.phase_noise * z[1]
        samples += 1
        if now >= scene.run.time_limit or (exact and amplitude <= settings.limit):
            return v, samples
        if amplitude <= settings.limit:
            integral, before = 0.0, None
        else:
            wanted, integral = _pid(scene, (now, amplitude, phase), before, integral)
            before = (now, amplitude, phase)
            now += _gas(scene, plain, fills, wanted, phase, scene.run.time_limit - now)
        now += min(settings.period, max(scene.run.time_limit - now, 0.0))


def _vibration(scene: Scene, model: BalancerModel, fills: Sequence[float], total: float) -> complex:
    rotor = scene.rotor
    k = cmath.rect(rotor.influence_coefficient, -rotor.lag_angle)
    moment = sum(
        float(model.moment.pair_moment(fill_ratio=x, opposite_fill_ratio=total - x))
        * cmath.rect(1.0, math.pi * i / len(fills))
        for i, x in enumerate(fills)
    )
    return cmath.rect(rotor.initial_amplitude, rotor.initial_phase) + k * moment


def _pid(
    scene: Scene,
    sample: tuple[float, float, float],
    before: tuple[float, float, float] | None,
    integral: float,
) -> tuple[float, float]:
    now, amplitude, phase = sample
    if before is None:
        return scene.controller.proportional * amplitude, integral
    dt, settings = now - before[0], scene.controller
    turned = math.cos(phase - before[2]) < 0
    area = 0.0 if turned else integral + (amplitude + before[1]) / 2 * dt
    slope = settings.derivative_time * (amplitude - before[1]) / dt
    wanted = settings.proportional * (amplitude + area / (settings.integral_time or math.inf) + slope)
    return wanted, integral if wanted > settings.maximum_gas_time and not turned else area


def _gas(
    scene: Scene, plain: Carried, fills: list[float], wanted: float, phase: float, remaining: float
) -> float:
    """Drive the two chambers and return the longest valve-open time, s."""
    settings, half, longest = scene.controller, len(fills), 0.0
    length = min(max(wanted, 0.0), settings.maximum_gas_time)
    angle = phase + settings.assumed_lag_angle
    between = math.pi / half
    first, past = divmod(angle % (2 * math.pi), between)
    near, far = (length * math.sin(part) / math.sin(between) for part in (between - past, past))
    for chamber, share in ((int(first) % (2 * half), near), ((int(first) + 1) % (2 * half), far)):
        duration = min(share, remaining)
        if share < settings.minimum_gas_time or duration <= 0:
            continue
        pair, positive = chamber % half, chamber < half
        driven = plain.operate(fills[pair] if positive else plain.total - fills[pair], duration)
        fills[pair] = driven if positive else plain.total - driven
        longest = max(longest, duration)
    return longest


def fastest(rival: Rival, dynamics: Dynamics, targets: list[tuple[float, float]]) -> tuple[str, float, float]:
    """Method and tolerance that keep each fill within `FILL_ERROR` in the least time; our largest error."""
    exact = [ours(dynamics, t, error=1e-10, count=1, fill=x) for x, t in targets]
    near = [ours(dynamics, t, error=RELATIVE_ERROR, count=1, fill=x) for x, t in targets]
    best = (math.inf, "", 0.0)
    for method in METHODS:
        for tolerance in TOLERANCES:
            inject = partial(rival.inject, method=method, tolerance=tolerance)
            if all(
                abs(inject(t, fill=x) - end) <= FILL_ERROR for (x, t), end in zip(targets, exact, strict=True)
            ):
                spent = least(lambda f=inject: [f(t, fill=x) for x, t in targets], 2)  # type: ignore[misc]
                best = min(best, (spent, method, tolerance))
                break
    if not best[1]:
        raise RuntimeError("solve_ivp does not reach the error asked for")
    return best[1], best[2], float(np.max(np.abs(np.subtract(near, exact))))


def check_same(scene: Scene, model: BalancerModel, carried: Carried) -> None:
    """Check that both sides do the same work. Raises: RuntimeError: their final amplitudes differ."""
    still = replace(scene, sensor=replace(scene.sensor, amplitude_noise=0.0, phase_noise=0.0))
    end, _ = plain_run(still, model, carried, 0)
    (single,) = LiquidRingBalancer(still).run({}, AS_GIVEN).final_amplitude
    error = abs(abs(end) - float(single))
    if error > END_ERROR:
        raise RuntimeError(f"{error:.1e} m apart at the end")


def rival_run(scene: Scene, model: BalancerModel, carried: Carried) -> None:
    """Compute `RIVAL_RUNS` noisy runs of the rival."""
    for seed in range(RIVAL_RUNS):
        plain_run(scene, model, carried, seed)


def growth(ensemble: Callable[[int], object], *, first: int, largest: int) -> list[dict[str, float]]:
    """Time and memory of ensembles that double up to the largest. Args: `ensemble`: runs so many members."""
    results, size = [], first
    while size <= largest:
        used = time.process_time()
        ensemble(size)
        spent, peak = time.process_time() - used, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        results.append({"members": size, "processor_s": spent, "peak_memory_MiB": peak / 1024})
        size *= 2
    return results


def compile_seconds() -> list[float]:
    """Processor time, s, of a machine's first run, which compiles, and of a later process's first run."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CACHE_DIR": folder}
        call = partial(subprocess.run, env=environment, capture_output=True, text=True, check=True)
        return [float(call([sys.executable, "-c", FIRST_CALL]).stdout) for _ in range(2)]


def compare(repeats: int, members: int, largest: int) -> dict[str, object]:
    """All measurements. Returns: A document for JSON."""
    scene = piped_scene()
    gain = GAIN * scene.controller.proportional
    scene = replace(
        scene,
        controller=replace(scene.controller, proportional=gain),
        run=replace(scene.run, time_limit=TIME_LIMIT),
    )
    model = calibrate(scene).model
    dynamics = dynamics_of(scene=scene, model=model, modelled=(INERTIA, FILLING, LAG, HELD))
    carried = Carried(rival=Rival(scene, model), total=2 * scene.disc.initial_fill)
    check_same(scene, model, carried)
    carried.targets.clear()
    plain_run(scene, model, carried, 0)
    by_time = sorted(carried.targets, key=lambda entry: entry[1])
    judged = [by_time[round(i)] for i in np.linspace(0, len(by_time) - 1, JUDGED)]
    carried.method, carried.tolerance, error = fastest(carried.rival, dynamics, judged)
    if error > FILL_ERROR:
        raise RuntimeError(f"an ensemble's fills are off by {error:.1e}")
    carried.targets.clear()
    theirs = least(partial(rival_run, scene, model, carried), repeats) / RIVAL_RUNS
    injections = len(carried.targets) / (repeats * RIVAL_RUNS)

    def run_devices(size: int) -> object:
        return LiquidRingBalancer(scene).run({}, Draws.first(size))

    run_devices(1)
    single = least(lambda: run_devices(members), repeats) / members
    return {
        "solve_ivp_s": theirs,
        "method": carried.method,
        "rtol": carried.tolerance,
        "injections": injections,
        "ours_s": single,
        "fill_error": error,
        "ratio": theirs / single,
        "wanted": WANTED,
        "growth": growth(run_devices, first=largest // 8, largest=largest),
        "first_run_s": compile_seconds(),
    }


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--members", type=int, default=1000)
    parser.add_argument("--largest", type=int, default=8000)
    targets = parser.parse_args()
    results = compare(targets.repeats, targets.members, targets.largest)
    if targets.json:
        print(json.dumps(results, indent=2))
        return
    for name, value in results.items():
        for row in value if isinstance(value, list) else (value,):
            print(f"{name}: {row}")


if __name__ == "__main__":
    main()
