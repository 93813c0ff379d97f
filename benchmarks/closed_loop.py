"""The closed loop beside scipy's solve_ivp: one operation, a whole run, and ensembles of noisy runs.

    python benchmarks/closed_loop.py [--json] [--repeats 5] [--members 100000] [--largest 1000000]

The rival is what one would write oneself: a plain Python loop of the target-vector algorithm whose operations
go through `solve_ivp` with events for stall and empty, at the loosest tolerance that keeps the fill within
1e-6.  Its right-hand side is either the paper's law in plain numbers, the cheapest that Python has, or a flow
law through its interface, as for a law of which nothing else is known.  Under the paper's law the fill is
a parabola in time, which Runge-Kutta steps hit exactly, so solve_ivp has an easy time there.  One operation
of ours is timed as `simulate` calls it, checks and record included, and as ensembles do, in a batch.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np
from closed_loop_plain import Plain, by_the_law, in_numbers, plain_run
from rich.console import Console
from rich.table import Table

from ringbalance.controller.closed_form import closed_form, has_closed_form
from ringbalance.controller.ensemble import ensemble_transfer, simulate_ensemble
from ringbalance.controller.loop import simulate
from ringbalance.controller.quadrature import quadrature
from ringbalance.controller.transfer import Drive
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.model import BalancerModel
from ringbalance.reduced_model.paper_law import paper_model
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.models import Scene

FILL_ERROR = 1e-6
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
BATCH = 10_000
PLAIN_RUNS = 3

Rivals = dict[str, Plain]


@dataclass(frozen=True, kw_only=True)
class Line:
    """One comparison."""

    what: str
    ours: float
    """s."""
    rival: float
    """s."""
    wanted: float
    """Ratio asked for."""

    @property
    def ratio(self) -> float:
        """How many times faster ours is."""
        return self.rival / self.ours


@dataclass(frozen=True, kw_only=True)
class Growth:
    """An ensemble of one size."""

    members: int
    seconds: float
    processor_seconds: float
    peak_memory_MiB: float  # noqa: N815 - the unit's own spelling


def median_seconds(action: Callable[[], object], repeats: int, inner: int = 1) -> float:
    """Median time of one call.

    Args:
        action: what to time.
        repeats: rounds, after one that warms caches.
        inner: calls in a round.

    Returns:
        s.
    """
    action()
    rounds = []
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(inner):
            action()
        rounds.append((time.perf_counter() - start) / inner)
    return statistics.median(rounds)


def drives_of(scene: Scene, model: BalancerModel) -> list[tuple[Drive, float]]:
    """Operations to judge a tolerance by: a usual one, and a long one from a full chamber.

    Args:
        scene: the scene.
        model: the balancer.

    Returns:
        Drives with their gas times, s.
    """
    rate, total = model.tube_area / model.chamber_volume, 2 * scene.disc.initial_fill
    return [
        (
            Drive(
                law=model.flow,
                fill=x,
                total=total,
                exchange_rate=rate,
                gas_pressure=scene.gas.pressure,
                primed=False,
            ),
            duration,
        )
        for x, duration in ((total / 2, 0.6), (0.8 * total, 0.9))
    ]


def loosest(scene: Scene, model: BalancerModel, velocity: Callable[[float], float]) -> Plain:
    """The rival with the loosest tolerance whose fills are right to `FILL_ERROR`.

    Args:
        scene: the scene.
        model: the balancer.
        velocity: its right-hand side.

    Returns:
        Plain.

    Raises:
        RuntimeError: no tolerance reaches it.
    """
    drives = drives_of(scene, model)
    integrator = closed_form if has_closed_form(model.flow) else quadrature
    exact = [integrator(drive, np.array([t])).fill[-1] for drive, t in drives]
    for tolerance in TOLERANCES:
        plain = Plain(
            velocity=velocity,
            rate=drives[0][0].exchange_rate,
            total=2 * scene.disc.initial_fill,
            tolerance=tolerance,
        )
        found = [plain.operate(drive.fill, t) for drive, t in drives]
        if max(abs(a - b) for a, b in zip(found, exact, strict=True)) <= FILL_ERROR:
            return plain
    raise RuntimeError("solve_ivp does not reach the error asked for")


def operation_lines(scene: Scene, model: BalancerModel, rivals: Rivals, repeats: int) -> list[Line]:
    """One operation: `closed_form` with its record, and the bare formula in a batch.

    Args:
        scene: the scene.
        model: the balancer.
        rivals: by name.
        repeats: timed rounds.

    Returns:
        Two lines for each rival.
    """
    drive, duration = drives_of(scene, model)[0]
    instants, transfer = np.array([duration]), ensemble_transfer(scene, model)
    fills, times = np.linspace(0.2, 0.3, BATCH), np.full(BATCH, duration)
    recorded = median_seconds(lambda: closed_form(drive, instants), repeats, 50)
    bare = median_seconds(lambda: transfer.after(fills, times), repeats, 5) / BATCH
    lines = []
    for name, plain in rivals.items():
        rival = median_seconds(partial(plain.operate, drive.fill, duration), repeats, 20)
        lines += [
            Line(what=f"{name}: one operation, recorded", ours=recorded, rival=rival, wanted=100),
            Line(what=f"{name}: one operation, in a batch", ours=bare, rival=rival, wanted=100),
        ]
    return lines


def run_lines(scene: Scene, model: BalancerModel, rivals: Rivals, repeats: int) -> list[Line]:
    """A whole run with an exact sensor, everything recorded on our side.

    Args:
        scene: the scene.
        model: the balancer.
        rivals: by name.
        repeats: timed rounds.

    Returns:
        A line for each rival.
    """
    still = replace(scene, sensor=replace(scene.sensor, amplitude_noise=0.0, phase_noise=0.0))
    ours = median_seconds(lambda: simulate(still, model), repeats)
    lines = []
    for name, plain in rivals.items():
        check_same(still, model, plain)
        rival = median_seconds(partial(plain_run, still, model, plain, 0), repeats)
        lines.append(Line(what=f"{name}: a whole run, recorded", ours=ours, rival=rival, wanted=20))
    return lines


def ensemble_lines(scene: Scene, model: BalancerModel, rivals: Rivals, members: int) -> list[Line]:
    """A noisy run among many, against a noisy run alone.

    Args:
        scene: the scene.
        model: the balancer.
        rivals: by name.
        members: of the ensemble.

    Returns:
        A line for each rival.
    """
    start = time.perf_counter()
    simulate_ensemble(scene, model, members, 0)
    ours = (time.perf_counter() - start) / members
    lines = []
    for name, plain in rivals.items():
        start = time.perf_counter()
        for seed in range(PLAIN_RUNS):
            plain_run(scene, model, plain, seed)
        rival = (time.perf_counter() - start) / PLAIN_RUNS
        lines.append(Line(what=f"{name}: a noisy run among {members}", ours=ours, rival=rival, wanted=1000))
    return lines


def compare(scene: Scene, *, repeats: int, members: int, console: Console) -> tuple[list[Line], Rivals]:
    """All ratios.

    Args:
        scene: the scene.
        repeats: timed rounds.
        members: of the ensembles.
        console: for progress.

    Returns:
        Lines and the rivals.
    """
    paper = paper_model(scene)
    rivals = {
        "paper's law in numbers": loosest(scene, paper, in_numbers(scene, paper)),
        "paper's law by its interface": loosest(scene, paper, by_the_law(scene, paper)),
    }
    console.print("one operation")
    lines = operation_lines(scene, paper, rivals, repeats)
    console.print("one run")
    lines += run_lines(scene, paper, rivals, repeats)
    console.print(f"{members} noisy runs under the paper's law")
    lines += ensemble_lines(scene, paper, rivals, members)
    console.print("calibration, and as many under the calibrated law with a gain that suits it")
    calibrated = calibrate(scene).model
    gain = 0.3 * scene.controller.proportional
    tuned = replace(scene, controller=replace(scene.controller, proportional=gain))
    own = {"calibrated law": loosest(tuned, calibrated, by_the_law(tuned, calibrated))}
    lines += ensemble_lines(tuned, calibrated, own, members)
    return lines, rivals | own


def check_same(scene: Scene, model: BalancerModel, plain: Plain) -> None:
    """Make sure that both sides do the same work.

    Args:
        scene: with an exact sensor.
        model: the balancer.
        plain: the rival.

    Raises:
        RuntimeError: they do not end alike.
    """
    ours = simulate(scene, model)
    end, samples = plain_run(scene, model, plain, 0)
    # A fill of 1e-6 in each operation is some 1e-9 m.
    if samples != len(ours.samples) or abs(abs(end) - ours.amplitude[-1]) > 1e-9:
        raise RuntimeError("the plain loop and simulate do not do the same")


def growth(scene: Scene, largest: int, console: Console) -> list[Growth]:
    """Ensembles by tens up to the largest.

    Args:
        scene: the scene.
        largest: members.
        console: for progress.

    Returns:
        One entry per size, smallest first.
    """
    model, found, size = paper_model(scene), [], 10_000
    while size <= largest:
        console.print(f"{size} members")
        start, used = time.perf_counter(), time.process_time()
        simulate_ensemble(scene, model, size, 0)
        found.append(
            Growth(
                members=size,
                seconds=time.perf_counter() - start,
                processor_seconds=time.process_time() - used,
                peak_memory_MiB=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            )
        )
        size *= 10
    return found


def document(lines: Sequence[Line], rivals: Rivals, sizes: Sequence[Growth]) -> dict[str, object]:
    """All that was measured.

    Args:
        lines: comparisons.
        rivals: by name.
        sizes: growth.

    Returns:
        A document for json.
    """
    return {
        "solve_ivp_rtol": {name: plain.tolerance for name, plain in rivals.items()},
        "fill_error": FILL_ERROR,
        "comparisons": [asdict(line) | {"ratio": line.ratio} for line in lines],
        "growth": [asdict(size) for size in sizes],
    }


def show(lines: Sequence[Line], sizes: Sequence[Growth], console: Console) -> None:
    """Print tables.

    Args:
        lines: comparisons.
        sizes: growth.
        console: where to.
    """
    table = Table(title="beside solve_ivp at 1e-6 in fill")
    for name in ("what", "ours, us", "solve_ivp, us", "times faster", "asked for"):
        table.add_column(name)
    for line in lines:
        table.add_row(
            line.what,
            f"{line.ours * 1e6:.4g}",
            f"{line.rival * 1e6:.4g}",
            f"{line.ratio:.4g}",
            f"{line.wanted:g}",
        )
    console.print(table)
    grown = Table(title="growth")
    for name in ("members", "s", "processor s", "peak memory, MiB"):
        grown.add_column(name)
    for size in sizes:
        grown.add_row(
            str(size.members),
            f"{size.seconds:.3g}",
            f"{size.processor_seconds:.3g}",
            f"{size.peak_memory_MiB:.4g}",
        )
    console.print(grown)


def main() -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--members", type=int, default=100_000)
    parser.add_argument("--largest", type=int, default=1_000_000)
    asked = parser.parse_args()
    told = Console(stderr=True)
    scene = load_scene(bundled_scene("liquid_ring_paper"))
    lines, rivals = compare(scene, repeats=asked.repeats, members=asked.members, console=told)
    sizes = growth(scene, asked.largest, told)
    if asked.json:
        print(json.dumps(document(lines, rivals, sizes), allow_nan=False, indent=2))
    else:
        show(lines, sizes, Console())


if __name__ == "__main__":
    main()
