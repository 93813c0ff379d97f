"""Finite elements: reliability of stated uncertainties (published and made-up sequences, random discs,
extremes), balances of force, torque, flux and volume on solved meshes, and totals by three routes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from ringbalance.mesh.chamber import FREE_SURFACE, default_cells
from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.physics.convergence import GridVerdict, gci
from ringbalance.physics.pressure.loads import liquid_integrals
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.physics.pressure.solve import PressureSolution, RotatingLiquid
from ringbalance.physics.pressure.surface import solve_with_gravity
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.scene.platform.files import cache_folder, packaged_rows
from ringbalance.verification.evidence import CaseTable, Evidence, Level, as_found
from ringbalance.verification.extremes.point import Ending
from ringbalance.verification.extremes.study import SIZES, Size, find_extremes
from ringbalance.verification.finite_elements import found_of, mesh_table, mutated_force, ring_of
from ringbalance.verification.papers import with_plate
from ringbalance.verification.reference.chambers import exact_moment, exact_totals, exact_wall_pressure
from ringbalance.verification.reference.pressure import tilted_liquid

_FORMAL_ORDER: Final = 2.0
_LAST_DIGITS: Final = {"order": 0.01, "limit": 0.0001, "error": 0.1, "index": 0.1}
_CELLS_OF_FIRST: Final = (18000, 8000, 4500)
_PUBLISHED: Final = (GridVerdict.MONOTONE, GridVerdict.NOT_ASYMPTOTIC, GridVerdict.OSCILLATORY)
_LIMIT: Final = 1.0
_MESH_SIZES: Final = np.array([1.0, 2.0, 4.0])
_QUANTITIES: Final = {
    "volume": "liquid_volume",
    "wall_pressure": "wall_pressure",
    "moment": "moment",
    "lambda": "moment_per_volume",
}
"""Totals of a ring by their names in the case."""
_CHAMBERS: Final = (4, 6, 8, 10)
_ROUND_OFF: Final = 1e-13
"""Relative error below which it is rounding of the exact value."""
_RANDOM_DISCS: Final = 240
_SEED: Final = 20
_WIDTHS: Final = {None: 1.0, "half_widths_quartered": 0.25, "half_widths_padded": 100.0}
_MUTATIONS: Final[Mapping[str | None, Mapping[str, float]]] = {
    None: {},
    "half_widths_hundredth": {"width_factor": 0.01},
    "liquid_lost": {"leak": 1e-6},
}
_FEW: Final = Size(points=40, sweep=2, fineness=1.0)
"""Size of a study in which a mutation shows."""
_WORKERS: Final = 2


class _Example(NamedTuple):
    """One published example of grid convergence, with its printed results."""

    values: tuple[float, ...]
    sizes: tuple[float, ...]
    printed: Mapping[str, tuple[float, ...]]


def gci_celik2008(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Three-mesh grid convergence against the published worked examples."""
    examples = _published_examples()
    power, safety = 2.0 if defect == "sizes_by_count" else 1.0, 1.0 if defect == "safety_dropped" else 1.25
    results = [
        gci(
            values=example.values,
            sizes=[size**power for size in example.sizes],
            formal_order=_FORMAL_ORDER,
            safety=safety,
        )
        for example in examples.values()
    ]
    printed = [example.printed for example in examples.values()]
    computed: list[Mapping[str, tuple[float, ...]]] = [
        {
            "order": (result.observed_order,),
            "limit": (result.extrapolated,),
            "error": (100 * result.approximate_error, 100 * result.extrapolated_error),
            "index": (100 * result.index,),
        }
        for result in results
    ]
    digits = {
        f"{name}_digits": max(
            abs(mine - theirs) / unit
            for ours, published in zip(computed, printed, strict=True)
            for mine, theirs in zip(ours[name], published[name], strict=True)
        )
        for name, unit in _LAST_DIGITS.items()
    }
    wrong = sum(result.verdict is not expected for result, expected in zip(results, _PUBLISHED, strict=True))
    table = CaseTable(
        name="published examples, printed and found",
        columns={
            "example": list(examples),
            "p printed": [published["order"][0] for published in printed],
            "p found": [result.observed_order for result in results],
            "limit printed": [published["limit"][0] for published in printed],
            "limit found": [result.extrapolated for result in results],
            "GCI printed, %": [published["index"][0] for published in printed],
            "GCI found, %": [100 * result.index for result in results],
            "verdict": [result.verdict.value for result in results],
        },
    )
    return Evidence(
        quantities=as_found(**digits, wrong_verdicts=wrong),
        numbers={"worst": max(digits.values())},
        tables=(table,),
    )


@lru_cache(maxsize=1)
def _published_examples() -> dict[str, _Example]:
    examples: dict[str, _Example] = {}
    path = ("gci_celik2008", "data", "celik2008_examples.csv")
    for row in packaged_rows("ringbalance.verification.cases", *path):
        number = {key: float(value) for key, value in row.items() if key != "case"}
        r21, r32 = number["r21"], number["r32"]
        if not examples:
            # Printed as 1.333; the counts give it exactly, and p moves in its third digit.
            fine, middle, coarse = _CELLS_OF_FIRST
            r21, r32 = (fine / middle) ** 0.5, (middle / coarse) ** 0.5
        examples[row["case"]] = _Example(
            values=(number["phi1"], number["phi2"], number["phi3"]),
            sizes=(1.0, r21, r21 * r32),
            printed={
                "order": (number["p"],),
                "limit": (number["phi_ext21"],),
                "error": (number["ea21_pct"], number["eext21_pct"]),
                "index": (number["GCI_fine21_pct"],),
            },
        )
    return examples


def gci_behaviour(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Grid convergence judged on constructed sequences with known limits."""
    h = _MESH_SIZES
    monotone, oscillatory = (GridVerdict.MONOTONE,), (GridVerdict.OSCILLATORY,)
    # Values on meshes of size 1, 2 and 4, with the verdicts that they allow.
    sequences: Mapping[str, tuple[FloatArray, tuple[GridVerdict, ...]]] = {
        "second order": (_LIMIT + 1e-3 * h**2, monotone),
        "with a fourth-order part": (_LIMIT + 1e-3 * h**2 + 1e-5 * h**4, monotone),
        "faster than formal": (_LIMIT + 1e-4 * h**4, (GridVerdict.NOT_ASYMPTOTIC,)),
        "oscillatory": (_LIMIT + 1e-3 * h**2 * np.array([1.0, -1.0, 1.0]), oscillatory),
        "slow": (_LIMIT + 1e-3 * h**0.6, (GridVerdict.NOT_ASYMPTOTIC, GridVerdict.DIVERGING)),
        "growing": (_LIMIT + 1e-3 * h**-1.0, (GridVerdict.DIVERGING,)),
        "round-off": (_LIMIT + np.array([0.0, 4e-16, -4e-16]), (GridVerdict.ROUND_OFF,)),
    }
    judged = {}
    for name, (values, _) in sequences.items():
        if defect == "signs_ignored":
            values = np.concatenate([values[:1], values[0] + np.cumsum(np.abs(np.diff(values)))])
        judged[name] = gci(
            values=values.tolist(),
            sizes=_MESH_SIZES.tolist(),
            formal_order=50.0 if defect == "cap_removed" else _FORMAL_ORDER,
        )
    results = judged.values()
    table = CaseTable(
        name="made-up sequences, all with the limit 1",
        columns={
            "sequence": list(judged),
            "verdict": [result.verdict.value for result in results],
            "observed order": [result.observed_order for result in results],
            "order used": [result.order for result in results],
            "half-width": [result.uncertainty for result in results],
        },
    )
    return Evidence(
        quantities=as_found(
            wrong_verdicts=sum(judged[name].verdict not in rest for name, (_, rest) in sequences.items()),
            capped_order=judged["faster than formal"].order,
            missed_limits=sum(
                abs(float(values[0]) - _LIMIT) > judged[name].uncertainty
                for name, (values, _) in sequences.items()
                if name != "growing"
            ),
        ),
        numbers={"sequences": float(len(sequences))},
        tables=(table,),
    )


def coverage(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Coverage and tightness of the half-widths: they hold the truth as often as they say, and are no wider.

    Random discs and fills, finite elements against the closed form; the same discs every time.
    """
    ratios = _error_ratios(_RANDOM_DISCS, _SEED) / _WIDTHS[defect]
    fared = {name: _fared(column) for name, column in zip(_QUANTITIES, ratios.T, strict=True)}
    table = CaseTable(
        name=f"{_RANDOM_DISCS} random discs, seed {_SEED}",
        columns={
            "quantity": [total.replace("_", " ") for total in _QUANTITIES.values()],
            "held": [each.share for each in fared.values()],
            "median error over half-width": [each.tightness for each in fared.values()],
            "largest error over half-width": [each.worst for each in fared.values()],
            "not at round-off": [float(each.judged) for each in fared.values()],
        },
    )
    return Evidence(
        quantities=as_found(
            **{f"{name}_share": each.share for name, each in fared.items()},
            **{f"{name}_tightness": each.tightness for name, each in fared.items()},
        ),
        numbers={"samples": float(_RANDOM_DISCS), "worst": max(each.worst for each in fared.values())},
        tables=(table,),
    )


class _Fared(NamedTuple):
    """Statistics of the half-widths of one quantity over all samples."""

    share: float
    """Fraction of the samples with the exact value within the half-width."""
    tightness: float
    """Median of |error| over half-width, samples at round-off left out."""
    judged: int
    """Number of samples not at round-off."""
    worst: float
    """Largest |error| over half-width."""


def _fared(ratios: FloatArray) -> _Fared:
    """Statistics of ratios |error| over half-width; nan: error at round-off, which counts as within."""
    judged = ratios[~np.isnan(ratios)]
    share = 1 - float(np.mean(ratios > 1))
    if not judged.size:
        return _Fared(share, 1.0, 0, 0.0)
    return _Fared(share, float(np.median(judged)), judged.size, float(judged.max()))


@lru_cache(maxsize=2)
def _error_ratios(count: int, seed: int) -> FloatArray:
    """|error| over half-width on random discs, shape (count, quantities); nan where it is at round-off.

    Discs of all proportions that the program accepts, with fills from thin to the largest.
    """
    generator = np.random.default_rng(seed)
    ratios = np.full((count, len(_QUANTITIES)), np.nan)
    for row in ratios:
        chambers = int(generator.choice(_CHAMBERS))
        angle = generator.uniform(0.7, 1.0) * 2 * math.pi / chambers
        outer = generator.uniform(15e-3, 200e-3)
        inner = outer * generator.uniform(0.2, 0.85)
        widest = inner * math.sin(min(angle, math.pi) / 2)
        largest = float(generator.choice([0.3, 0.5, 0.8]))
        disc = Disc(
            outer_radius=outer,
            inner_radius=inner,
            axial_width=generator.uniform(5e-3, 150e-3),
            central_angle=angle,
            chambers=chambers,
            plate_thickness=float(generator.choice([0.0, 1.0])) * generator.uniform(0.0, 0.5) * widest,
            max_fill_ratio=largest,
            initial_fill=largest / 2,
        )
        density, omega = generator.uniform(700, 6100), float(generator.uniform(80, 6000))
        x = disc.max_fill_ratio * generator.uniform(0.02, 1.0)
        ring = ring_quantities(disc=disc, density=density, angular_velocity=omega, fill_ratio=x)
        if not ring.status.ok:
            raise RuntimeError(ring.status.text)
        a = surface_radius(disc=disc, fill_ratio=x)
        alpha = half_angle(disc=disc, radius=a)
        pressure = exact_wall_pressure(disc=disc, density=density, angular_velocity=omega, fill_ratio=x)
        exact: dict[str, npt.ArrayLike] = {
            "liquid_volume": x * chamber_volume(disc=disc),
            "wall_pressure": pressure,
            "moment": exact_moment(disc=disc, density=density, fill_ratio=x),
            "moment_per_volume": density * a * np.sin(alpha) / alpha,
        }
        for index, name in enumerate(_QUANTITIES.values()):
            estimate, true = getattr(ring, name), float(np.asarray(exact[name]))
            error = abs(float(estimate.value[0]) - true)
            if error > _ROUND_OFF * abs(true):
                row[index] = error / float(estimate.uncertainty[0])
    return ratios


def extremes(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The designed set and the axes of the extremes; a heavy run."""
    result = find_extremes(
        scene,
        size=SIZES[level] if defect is None else _FEW,
        workers=_WORKERS,
        folder=cache_folder() / "extremes" if level == "heavy" and defect is None else None,
        mutation=_MUTATIONS[defect],
    )
    document, named = result.to_dict(), (Ending.SOLVED, Ending.WIDE, Ending.STATUS, Ending.REFUSED)
    worst = document["worst_error_over_half_width"]
    return Evidence(
        quantities=as_found(broken=result.broken(), worst=worst),
        numbers={
            "judged": document["judged"],
            "points": document["points"],
            "residual": document["worst_residual"],
            "worst": worst,
            **{ending.name.lower(): float(document["endings"][str(ending)]) for ending in named},
        },
        tables=(CaseTable(name="axes", columns=result.axes_table()),),
    )


_FILL_OF_MAX: Final = 0.8


def conservation(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Balances on meshes with a free surface located under gravity."""
    fill = _FILL_OF_MAX * scene.disc.max_fill_ratio
    radial, angular = default_cells(disc=scene.disc)
    balances = [_section_balance(scene, fill, (radial // k, angular // k), defect) for k in (4, 2, 1)]
    volume = float(ring_of(scene, (fill,)).liquid_volume.value[0])
    liquid = tilted_liquid(disc=scene.disc, density=scene.liquid.density, fill_ratio=fill, shaft="vertical")
    solution = _solved(scene, liquid, fill, (radial // 2, angular // 2, 4))
    loads = liquid_integrals(solution=solution, density=liquid.density, axial_width=scene.disc.axial_width)
    weight = liquid.density * loads.volume * liquid.gravity[2]
    axial: FloatArray = np.array([force[2] for force in loads.force.values()])
    return Evidence(
        quantities=as_found(
            **{name: max(balance[name] for balance in balances) for name in balances[0]},
            weight_balance=abs(float(axial.sum()) / weight - 1),
            volume_drawn=abs(volume / (fill * chamber_volume(disc=scene.disc)) - 1),
        )
    )


def _section_balance(
    scene: Scene, fill: float, cells: tuple[int, ...], defect: str | None
) -> dict[str, float]:
    """Relative residuals of one two-dimensional solution."""
    true = tilted_liquid(disc=scene.disc, density=scene.liquid.density, fill_ratio=fill, shaft="horizontal")
    with mutated_force(y_factor=1.01 if defect == "force_across_off_by_a_percent" else 1.0):
        solution = _solved(scene, true, fill, cells)
    loads = liquid_integrals(solution=solution, density=true.density, axial_width=scene.disc.axial_width)
    forces = dict(loads.force)
    if defect == "plate_force_dropped":
        forces["plate_left"] = np.zeros(3)
    gravity, moment = np.array((*true.gravity, 0.0)), loads.first_moment
    body = true.angular_velocity**2 * moment + true.density * loads.volume * gravity
    turning = moment[0] * gravity[1] - moment[1] * gravity[0]
    size = float(np.linalg.norm(body))
    torque = sum(loads.torque.values()) - turning
    # Flux out through the surface plus flux through the walls, less the source.
    unit = solution.chamber.length_scale
    source = unit * float(solution.basis.dx.sum()) * 2 * true.density * true.angular_velocity**2
    surface = solution.side(FREE_SURFACE)
    flux = float(np.sum(surface.weights * solution.surface_flux(surface)))
    for name in solution.chamber.mesh.boundaries:
        if name != FREE_SURFACE:
            wall = solution.side(name)
            flux += float(np.sum(true.body_force(unit * wall.points) * wall.area))
    return {
        "force_balance": float(np.linalg.norm(sum(forces.values()) - body)) / size,
        "torque_balance": abs(float(torque)) / (size * scene.disc.outer_radius),
        "flux_balance": abs(flux / source - 1),
        "volume_found": abs(solution.statistics.extra["volume_error"]),
    }


def _solved(scene: Scene, liquid: RotatingLiquid, fill: float, cells: tuple[int, ...]) -> PressureSolution:
    solution = solve_with_gravity(disc=scene.disc, liquid=liquid, fill_ratio=fill, cells=cells)
    if not solution.status.ok:
        raise ValueError(solution.status.text)
    return solution


_UNITS: Final = {"wall_pressure": "Pa", "moment": "kg m", "liquid_volume": "m^3"}


def independent_routes(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Wall pressure, moment, volume and lambda by three routes: two meshes and closed forms."""
    exact = exact_totals(scene)
    exact["volume"] *= scene.disc.max_fill_ratio
    rings = {dimension: _ring(scene, dimension, defect) for dimension in (2, 3)}
    quantities = {
        f"{short}_{d}d": found_of(ring, name, 0).against(exact[short])
        for d, ring in rings.items()
        for name in _UNITS
        for short in [name.removeprefix("liquid_")]
    }
    centre = found_of(_ring(scene, 2, defect, share=0.5), "moment_per_volume", 0)
    quantities["lambda_2d"] = centre.scaled(2 / scene.liquid.density).against(exact["lambda"])
    moment = quantities["moment_2d"]
    return Evidence(
        quantities=quantities,
        numbers={"moment_share": abs(moment.value - exact["moment"]) / (2 * moment.numerical)},
        convergence=tuple(mesh_table(rings[2], name, unit, 0) for name, unit in _UNITS.items()),
        status=rings[2].status,
    )


def _ring(scene: Scene, dimension: int, defect: str | None, share: float = 1.0) -> RingQuantities:
    disc = with_plate(scene.disc, 0.0) if defect == "plates_left_out" else scene.disc
    factor = 1.00001 if defect == "force_off" else 1.0
    with mutated_force(x_factor=factor, y_factor=factor):
        return ring_quantities(
            disc=disc,
            density=scene.liquid.density,
            angular_velocity=scene.rotor.speed,
            fill_ratio=share * scene.disc.max_fill_ratio,
            dimension=dimension,
        )
