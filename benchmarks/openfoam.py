"""The program compared with OpenFOAM: the rotating tube, straight and bent, waves on the ring, the gas jet.

    python benchmarks/openfoam.py [--out out/openfoam] [--only tube bend turbulent waves jet] [--keep]

Needs Debian's package `openfoam` (1912), which is used only here.  Every quantity is computed on three
meshes; its uncertainty is that of the grid convergence index, and the two agree when their difference is
within both uncertainties.  `--keep` writes the results, dated, to benchmarks/openfoam.json and
docs/beside-openfoam.md.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from openfoam_case import missing
from openfoam_jets import GAS, LIQUID, WIDTH_M, Bath, crater
from openfoam_jets import GRAVITY as FALL
from openfoam_page import page
from openfoam_tubes import bent_tube, straight_tube
from openfoam_waves import (
    GRAVITY,
    Chamber,
    Record,
    frequencies,
    push,
    quasi_static,
    swing,
    track,
    turning_gravity,
)

from ringbalance.mesh.geometry import surface_radius
from ringbalance.physics.convergence import gci
from ringbalance.physics.gas_jet import Jet, crater_depth
from ringbalance.physics.sloshing import sloshing_modes, sloshing_response
from ringbalance.physics.tube.friction import rotation_reynolds_number
from ringbalance.physics.tube.loss import model_parts
from ringbalance.physics.tube.rotation_table import rotating_friction_ratio
from ringbalance.physics.tube.state import tube_state_at
from ringbalance.reports.saved import PACKAGED
from ringbalance.scene import write_whole
from ringbalance.scene.loader import bundled_scene, load_scene
from ringbalance.scene.models import Disc, Scene
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.verification.cases.bent_tube import REYNOLDS, VISCOSITY_M2_S, path_over_crest
from ringbalance.verification.navier_stokes.tube import (
    SectionMesh,
    developed_section,
    friction_ratio,
)
from ringbalance.verification.reference.bent_tube import BentTubeFlow, Segment

HERE = Path(__file__).resolve().parent
KEPT = HERE / "openfoam.json"
PAGE = HERE.parent / "docs" / "beside-openfoam.md"
FORMAL_ORDER = 2.0
LAMINAR = ((1e4, 0.5), (1e5, 0.5))
"""Pairs of Kl = R Re and S = R/Re."""
TURBULENT = ((1e4, 0.0), (1e4, 2356.0), (2e4, 2356.0))
"""Pairs of Re and R; R = 2356 is water in the paper's tube."""
FILLS = (0.25, 0.45)
PRESSURES = (0.25, 0.5, 1.0)
"""q over (rho - rho_g) g d of the jets."""
STEPS, WRITES, RAMP, TURNS, PUSH = 150, 25, 9.0, 14.0, 0.4


@dataclass(frozen=True, kw_only=True)
class Answer:
    """Answer of the program: a value with its half-width (95 %), and the processor time for it, s."""

    value: float
    half_width: float
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Row:
    """One quantity by both programs."""

    quantity: str
    openfoam: float
    """OpenFOAM's value on the finest mesh."""
    on_meshes: tuple[float, ...]
    """OpenFOAM's values, coarse to fine."""
    openfoam_half_width: float
    """Expanded uncertainty (95 %) of OpenFOAM's value, of discretisation alone."""
    ringbalance: float
    ringbalance_half_width: float
    """Expanded uncertainty (95 %) of the program's value, all causes included."""
    seconds: float
    """Processor time of OpenFOAM's finest mesh."""
    ringbalance_seconds: float
    """Processor time of the program's answer."""
    cells: tuple[int, ...]
    """Cells along one length, coarse to fine: around a quarter of the section, or around the chamber."""

    @property
    def agrees(self) -> bool:
        """True if the difference lies within both uncertainties."""
        both = float(np.hypot(self.openfoam_half_width, self.ringbalance_half_width))
        return bool(abs(self.openfoam - self.ringbalance) <= both)


def row(
    *, quantity: str, values: Sequence[float], cells: Sequence[int], ours: Answer,
    seconds: float,
) -> Row:  # fmt: skip
    """Row from the values of three meshes, coarse to fine, with numbers of cells along one length."""
    sizes = [1 / count for count in cells[::-1]]
    results = gci(values=list(values)[::-1], sizes=sizes, formal_order=FORMAL_ORDER, round_off=1e-6)
    return Row(
        quantity=quantity, openfoam=values[-1], on_meshes=tuple(values),
        openfoam_half_width=float(results.uncertainty),
        ringbalance=ours.value, ringbalance_half_width=ours.half_width, seconds=seconds,
        ringbalance_seconds=ours.seconds,
        cells=tuple(cells),
    )  # fmt: skip


def tube(_: Scene, out: Path) -> Iterator[Row]:
    """Laminar friction of the straight rotating tube over that at rest."""
    for kl, s in LAMINAR:
        reynolds = (kl / s) ** 0.5
        rotation = s * reynolds
        around = (8, 12, 16)
        runs = [
            straight_tube(
                folder=out / f"tube-{n}", reynolds=reynolds, rotation_reynolds=rotation,
                cells=(n, 3 * n // 2, 3.0), turbulent=False,
            )
            for n in around
        ]  # fmt: skip
        yield row(
            quantity=f"laminar friction over that at rest, Re {reynolds:.0f}, R {rotation:.0f}",
            values=[f * reynolds / 64 for f, _ in runs], cells=around,
            ours=_solved_section(reynolds, rotation), seconds=runs[-1][1].seconds,
        )  # fmt: skip


def _solved_section(reynolds: float, rotation: float) -> Answer:
    table = rotating_friction_ratio(reynolds=reynolds, rotation_reynolds=rotation)
    begin = time.process_time()
    system = SectionMesh(around=8, across=12, wall_ratio=15.0).system()
    solved = developed_section(system=system, kl=reynolds * rotation, s=rotation / reynolds)
    seconds = time.process_time() - begin
    return Answer(value=friction_ratio(solved), half_width=float(table.uncertainty), seconds=seconds)


def bend(scene: Scene, out: Path) -> Iterator[Row]:
    """Loss over two bends of a rotating tube, compared with the stored three-dimensional solution."""
    start, end = 2.0, 20.0
    rotation = rotation_reynolds_number(
        angular_velocity=scene.rotor.speed, bore=scene.tube.bore, kinematic_viscosity=VISCOSITY_M2_S
    )
    around = (4, 6, 8)
    runs = [
        bent_tube(
            folder=out / f"bend-{n}", segments=_refined(path_over_crest(scene, 2.0), n / 4),
            cells=(n, 3 * n // 2, 3.0), reynolds=REYNOLDS, rotation_reynolds=rotation,
        )
        for n in around
    ]  # fmt: skip
    yield row(
        quantity=f"loss coefficient, {end - start:g} bores and two bends, Re {REYNOLDS:g}, R {rotation:.0f}",
        values=[results.loss(start, end) for results in runs], cells=around,
        ours=_kept_loss(start, end, seconds=_time_of_a_solve(scene, rotation)), seconds=runs[-1].seconds,
    )  # fmt: skip


def _refined(segments: Sequence[Segment], factor: float) -> list[Segment]:
    return [replace(segment, cells=round(segment.cells * factor)) for segment in segments]


def _time_of_a_solve(scene: Scene, rotation: float) -> float:
    """Processor time, s, of a solve on the second of three meshes, whose error of 0.4 % is about that of
    OpenFOAM's finest."""
    begin = time.process_time()
    BentTubeFlow.of(
        segments=path_over_crest(scene, 1.5), cells=SectionMesh(around=2, across=3, wall_ratio=3.0),
        reynolds=REYNOLDS, rotation_reynolds=rotation,
    )  # fmt: skip
    return time.process_time() - begin


def _kept_loss(start: float, end: float, *, seconds: float) -> Answer:
    """Loss between two arc lengths by heavy case bent_tube_3d, with its fraction of the total uncertainty."""
    stored = json.loads((HERE.parent / "reports/data" / PACKAGED).read_text(encoding="utf-8"))
    case = next(case for case in stored["verification"] if case["id"] == "bent_tube_3d")
    series = case["series"][0]
    at, beyond = np.array(series["x"]["values"]), np.array(series["y"][0]["values"])
    k_total = case["numbers"]["k"]
    straight = (k_total - beyond[-1]) / at[-1] * (end - start)
    loss = straight + np.interp(end, at, beyond) - np.interp(start, at, beyond)
    half = float(case["numbers"]["half_width"] * loss / k_total)
    return Answer(value=float(loss), half_width=half, seconds=seconds)


def turbulent(scene: Scene, out: Path) -> Iterator[Row]:
    """Turbulent friction by the k-omega SST model, which was not developed for a rotating frame."""
    smooth = replace(scene.tube, roughness=0.0, bends=())
    for reynolds, rotation in TURBULENT:
        around = (6, 8, 10)
        runs = [
            straight_tube(
                folder=out / f"turbulent-{n}", reynolds=reynolds, rotation_reynolds=rotation,
                cells=(n, 3 * n, 60.0), turbulent=True,
            )
            for n in around
        ]  # fmt: skip
        begin = time.process_time()
        state = tube_state_at(tube=smooth, reynolds=[reynolds], rotation_reynolds=rotation)
        parts = model_parts(tube=smooth, state=state)
        half = np.hypot(parts["friction correlation"][0], parts["rotation model"][0])
        ours = Answer(
            value=float(state.rotating_friction[0]), half_width=float(half) * smooth.bore / smooth.length,
            seconds=time.process_time() - begin,
        )  # fmt: skip
        yield row(
            quantity=f"turbulent friction factor, Re {reynolds:.0f}, R {rotation:.0f}",
            values=[f for f, _ in runs], cells=around,
            ours=ours, seconds=runs[-1][1].seconds,
        )  # fmt: skip


def waves(scene: Scene, out: Path) -> Iterator[Row]:
    """Response to gravity at the rotation frequency, and the lowest free frequencies, without plates."""
    disc = replace(scene.disc, plate_thickness=0.0)
    cells = ((6, 36), (8, 48), (12, 72))
    for fill in FILLS:
        chambers = [
            Chamber(
                central_angle=disc.central_angle, cells=count,
                surface_radius=float(surface_radius(disc=disc, fill_ratio=fill)) / disc.outer_radius,
            )
            for count in cells
        ]  # fmt: skip
        results = [_answers(chamber, out / f"waves-{chamber.cells[0]}") for chamber in chambers]
        for name, ours in _theory(disc, fill).items():
            yield row(
                quantity=f"{name}, fill {fill:g}", values=[values[name] for values in results],
                cells=[around for _, around in cells], ours=ours, seconds=results[-1]["seconds"],
            )  # fmt: skip


def _answers(chamber: Chamber, folder: Path) -> dict[str, float]:
    def follow(force: Any, turns: float, writes: int) -> Record:
        return track(folder=folder, chamber=chamber, force=force, turns=turns, steps=STEPS, writes=writes)

    forced = follow(turning_gravity(ramp=RAMP), TURNS, WRITES)
    free = follow(push(duration=PUSH), TURNS, 1)
    moment, pressure = quasi_static(chamber)
    in_line, across = (abs(swing(forced.moment_time, column, turns=3)) for column in forced.moment.T)
    wall = abs(swing(forced.time, forced.wall, turns=3))
    first, second = frequencies(free.time, free.wall, after=PUSH, count=2)
    return {
        "swing of the moment over quasi-static": float(np.hypot(in_line, across)) / moment,
        "swing of the wall pressure over quasi-static": wall / pressure,
        "first free frequency over the speed": float(first),
        "second free frequency over the speed": float(second),
        "seconds": forced.seconds + free.seconds,
    }  # fmt: skip


def _theory(disc: Disc, fill: float) -> dict[str, Answer]:
    """Linear theory; neglected are terms of the second order in the waves' height over the depth."""
    begin = time.process_time()
    swung = sloshing_response(
        disc=disc, fill_ratio=[fill], angular_velocity=1.0, kinematic_viscosity=0.0,
        gravity=GRAVITY * disc.outer_radius,
    )  # fmt: skip
    free = sloshing_modes(disc=disc, fill_ratio=[fill], modes=2).frequency_ratio
    seconds = time.process_time() - begin
    depth = disc.outer_radius - float(swung.surface_radius[0])
    second_order = (float(swung.surface_amplitude.value[0]) / depth) ** 2
    pairs = {
        "swing of the moment over quasi-static": (swung.amplification, 0),
        "swing of the wall pressure over quasi-static": (swung.pressure_amplification, 0),
        "first free frequency over the speed": (free, 0),
        "second free frequency over the speed": (free, 1),
    }
    results = {}
    for name, (estimate, i) in pairs.items():
        value, cells = float(np.ravel(estimate.value)[i]), float(np.ravel(estimate.uncertainty)[i])
        half = float(np.hypot(cells, second_order * value))
        results[name] = Answer(value=value, half_width=half, seconds=seconds)
    return results


def jet(_: Scene, out: Path) -> Iterator[Row]:
    """Depth of the crater of a plane jet, as long as the surface lies in the core of the jet."""
    for pressure in PRESSURES:
        cells = (3, 4, 6)
        runs = [
            crater(folder=out / f"jet-{n}", bath=Bath(pressure=pressure, distance=3.0, cells=n))
            for n in cells
        ]
        begin = time.process_time()
        far, density = 1e3 * WIDTH_M, LIQUID - GAS
        # A ring so large that it is a bath, and a jet that keeps its pressure.
        ours = crater_depth(
            Jet(
                pressure=np.array(math.nan), momentum=np.array(math.inf),
                stagnation=np.array(pressure * density * FALL * WIDTH_M),
            ),
            distance=3 * WIDTH_M, surface_radius=far, density=density, speed=math.sqrt(FALL / far),
        )  # fmt: skip
        answer = Answer(
            value=float(ours) / WIDTH_M, half_width=0.0, seconds=time.process_time() - begin
        )  # fmt: skip
        results = row(
            quantity=f"depth over the slot's width, q/((rho - rho_g) g d) = {pressure:g}",
            values=[each.depth for each in runs], cells=cells, ours=answer, seconds=runs[-1].seconds,
        )  # fmt: skip
        # What is left of the bath's waves, which the mean over two periods contains.
        both = float(np.hypot(results.openfoam_half_width, runs[-1].deviation))
        yield replace(results, openfoam_half_width=both)


STUDIES: dict[str, Callable[[Scene, Path], Iterator[Row]]] = {
    "tube": tube,
    "bend": bend,
    "turbulent": turbulent,
    "waves": waves,
    "jet": jet,
}


def _said(results: Row) -> str:
    theirs = f"{results.openfoam:.5g} +- {results.openfoam_half_width:.2g}"
    ours = f"{results.ringbalance:.5g} +- {results.ringbalance_half_width:.2g}"
    times = f"{results.seconds:.3g} and {results.ringbalance_seconds:.3g} s"
    return f"{results.quantity}: {theirs}, here {ours}; {times}"


def main() -> int:
    """Run the studies, print a line for each quantity, and keep them if asked to."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("out/openfoam"))
    parser.add_argument("--only", nargs="+", choices=list(STUDIES), default=list(STUDIES))
    parser.add_argument("--keep", action="store_true")
    options = parser.parse_args()
    if needed := missing():
        print(needed, file=sys.stderr)
        return 1
    scene = liquid_ring_scene(load_scene(bundled_scene("liquid_ring_paper")))
    document = {"openfoam": "1912", "machine": platform.machine()}
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {"rows": {}, "dates": {}}
    rows, dates = kept["rows"], kept["dates"]
    for name in options.only:
        rows[name] = []
        for results in STUDIES[name](scene, options.out):
            rows[name].append({**asdict(results), "agrees": results.agrees})
            print(_said(results), flush=True)
        if options.keep:
            dates[name] = date.today().isoformat()
            document |= {"dates": dates, "rows": rows}
            write_whole(KEPT, json.dumps(document, indent=1) + "\n")
            write_whole(PAGE, page(document))
    return 0


if __name__ == "__main__":
    sys.exit(main())
