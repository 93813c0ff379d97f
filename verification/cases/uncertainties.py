"""Whether stated uncertainties hold: on published and made-up sequences, random discs and extremes."""

from __future__ import annotations

import csv
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.physics.convergence import GridConvergence, GridVerdict, gci
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.scene import bundled_scene
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.scene.platform.files import cache_folder
from ringbalance.verification.evidence import Evidence, Found, Level, Table, as_found
from ringbalance.verification.extremes.design import Base
from ringbalance.verification.extremes.point import SOUND, Defect, Ending
from ringbalance.verification.extremes.study import SIZES, Size, counted, find_extremes
from ringbalance.verification.reference.exact_chamber import exact_moment, exact_wall_pressure

_FORMAL_ORDER: Final = 2.0
_LAST_DIGIT: Final = {"order": 0.01, "limit": 0.0001, "error": 0.1, "index": 0.1}
_CELLS_OF_FIRST: Final = (18000, 8000, 4500)
_EXPECTED: Final = (GridVerdict.MONOTONE, GridVerdict.NOT_ASYMPTOTIC, GridVerdict.OSCILLATORY)


@dataclass(frozen=True, kw_only=True)
class _Column:
    """One published example."""

    name: str
    values: tuple[float, ...]
    sizes: tuple[float, ...]
    printed: Mapping[str, tuple[float, ...]]


def gci_celik2008(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Three-mesh grid convergence against the published worked examples."""
    columns = _columns()
    found = [_gci_celik2008_judge(column, defect) for column in columns]
    digits = {
        name: max(
            abs(mine - theirs) / unit
            for column, result in zip(columns, found, strict=True)
            for mine, theirs in zip(_results(result)[name], column.printed[name], strict=True)
        )
        for name, unit in _LAST_DIGIT.items()
    }
    wrong = sum(result.verdict is not expected for result, expected in zip(found, _EXPECTED, strict=True))
    return Evidence(
        found={f"{name}_digits": Found(value=value) for name, value in digits.items()}
        | as_found(wrong_verdicts=wrong),
        numbers={"worst": max(digits.values())},
        tables=(_gci_celik2008_table(columns, found),),
    )


@lru_cache(maxsize=1)
def _columns() -> tuple[_Column, ...]:
    path = files("ringbalance.verification.cases") / "gci_celik2008" / "data" / "celik2008_examples.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return tuple(_column(row, first=index == 0) for index, row in enumerate(rows))


def _column(row: Mapping[str, str], *, first: bool) -> _Column:
    number = {key: float(value) for key, value in row.items() if key != "case"}
    fine, middle, coarse = _CELLS_OF_FIRST
    r21, r32 = number["r21"], number["r32"]
    if first:
        # Printed as 1.333; the counts give it exactly, and p moves in its third digit.
        r21, r32 = (fine / middle) ** 0.5, (middle / coarse) ** 0.5
    return _Column(
        name=row["case"],
        values=(number["phi1"], number["phi2"], number["phi3"]),
        sizes=(1.0, r21, r21 * r32),
        printed={
            "order": (number["p"],),
            "limit": (number["phi_ext21"],),
            "error": (number["ea21_pct"], number["eext21_pct"]),
            "index": (number["GCI_fine21_pct"],),
        },
    )


def _gci_celik2008_judge(column: _Column, defect: str | None) -> GridConvergence:
    power = 2.0 if defect == "sizes_by_count" else 1.0
    return gci(
        values=column.values,
        sizes=[size**power for size in column.sizes],
        formal_order=_FORMAL_ORDER,
        safety=1.0 if defect == "safety_dropped" else 1.25,
    )


def _results(result: GridConvergence) -> Mapping[str, tuple[float, ...]]:
    return {
        "order": (result.observed_order,),
        "limit": (result.extrapolated,),
        "error": (100 * result.approximate_error, 100 * result.extrapolated_error),
        "index": (100 * result.index,),
    }


def _gci_celik2008_table(columns: Sequence[_Column], found: Sequence[GridConvergence]) -> Table:
    return Table(
        name="published examples, printed and found",
        columns={
            "example": [column.name for column in columns],
            "p printed": [column.printed["order"][0] for column in columns],
            "p found": [result.observed_order for result in found],
            "limit printed": [column.printed["limit"][0] for column in columns],
            "limit found": [result.extrapolated for result in found],
            "GCI printed, %": [column.printed["index"][0] for column in columns],
            "GCI found, %": [100 * result.index for result in found],
            "verdict": [result.verdict.value for result in found],
        },
    )


_LIMIT: Final = 1.0
_FORMAL: Final = 2.0
_MESH_SIZES: Final = np.array([1.0, 2.0, 4.0])


@dataclass(frozen=True, kw_only=True)
class _Sequence:
    """Values on meshes of size 1, 2 and 4, with what must be said of them."""

    name: str
    values: FloatArray
    expected: tuple[GridVerdict, ...]
    converges: bool = True


def _sequences() -> tuple[_Sequence, ...]:
    h = _MESH_SIZES
    astray = (GridVerdict.NOT_ASYMPTOTIC, GridVerdict.DIVERGING)
    return (
        _Sequence(name="second order", values=_LIMIT + 1e-3 * h**2, expected=(GridVerdict.MONOTONE,)),
        _Sequence(
            name="with a fourth-order part",
            values=_LIMIT + 1e-3 * h**2 + 1e-5 * h**4,
            expected=(GridVerdict.MONOTONE,),
        ),
        _Sequence(
            name="faster than formal", values=_LIMIT + 1e-4 * h**4, expected=(GridVerdict.NOT_ASYMPTOTIC,)
        ),
        _Sequence(
            name="oscillatory",
            values=_LIMIT + 1e-3 * h**2 * np.array([1.0, -1.0, 1.0]),
            expected=(GridVerdict.OSCILLATORY,),
        ),
        _Sequence(name="slow", values=_LIMIT + 1e-3 * h**0.6, expected=astray),
        _Sequence(
            name="growing", values=_LIMIT + 1e-3 * h**-1.0, expected=(GridVerdict.DIVERGING,), converges=False
        ),
        _Sequence(
            name="round-off",
            values=_LIMIT + np.array([0.0, 4e-16, -4e-16]),
            expected=(GridVerdict.ROUND_OFF,),
        ),
    )


def gci_behaviour(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Grid convergence judged on sequences that were made from their limit."""
    sequences = _sequences()
    judged = {one.name: _gci_behaviour_judge(one, defect) for one in sequences}
    wrong = sum(judged[one.name].verdict not in one.expected for one in sequences)
    errors = {one.name: abs(float(one.values[0]) - _LIMIT) for one in sequences if one.converges}
    missed = sum(error > judged[name].uncertainty for name, error in errors.items())
    return Evidence(
        found=as_found(
            wrong_verdicts=wrong,
            capped_order=judged["faster than formal"].order,
            missed_limits=missed,
        ),
        numbers={"sequences": float(len(sequences))},
        tables=(_gci_behaviour_table(judged),),
    )


def _gci_behaviour_judge(one: _Sequence, defect: str | None) -> GridConvergence:
    values = _by_magnitude(one.values) if defect == "signs_ignored" else one.values
    formal = 50.0 if defect == "cap_removed" else _FORMAL
    return gci(values=values.tolist(), sizes=_MESH_SIZES.tolist(), formal_order=formal)


def _by_magnitude(values: FloatArray) -> FloatArray:
    return np.concatenate([values[:1], values[0] + np.cumsum(np.abs(np.diff(values)))])


def _gci_behaviour_table(judged: Mapping[str, GridConvergence]) -> Table:
    return Table(
        name="made-up sequences, all with the limit 1",
        columns={
            "sequence": list(judged),
            "verdict": [result.verdict.value for result in judged.values()],
            "observed order": [result.observed_order for result in judged.values()],
            "order used": [result.order for result in judged.values()],
            "half-width": [result.uncertainty for result in judged.values()],
        },
    )


_QUANTITIES: Final = ("liquid_volume", "wall_pressure", "moment", "moment_per_volume")
_CHAMBERS: Final = (4, 6, 8, 10)
_ROUND_OFF: Final = 1e-13
"""Relative errors below this are the exact value's own rounding."""
_COUNT: Final = 240
_SEED: Final = 20
_NAMES: Final = ("volume", "wall_pressure", "moment", "lambda")
_FACTORS: Final = {None: 1.0, "half_widths_quartered": 0.25, "half_widths_padded": 100.0}


@dataclass(frozen=True, kw_only=True)
class _Sample:
    """One random disc at one fill."""

    disc: Disc
    density: float
    """kg/m^3."""
    angular_velocity: float
    """rad/s."""
    fill_ratio: float


@dataclass(frozen=True, kw_only=True)
class _Coverage:
    """How one quantity fared over all samples."""

    share: float
    """Of the samples whose half-width holds the exact value."""
    tightness: float
    """Median of |error| over half-width, samples at round-off left out."""
    judged: int
    """Samples not at round-off."""
    worst: float
    """Largest |error| over half-width."""


def _random_samples(*, count: int, seed: int) -> tuple[_Sample, ...]:
    """Discs of all proportions that the program accepts, with fills from thin to the largest."""
    generator = np.random.default_rng(seed)
    return tuple(_sample(generator) for _ in range(count))


def _sample(generator: np.random.Generator) -> _Sample:
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
    return _Sample(
        disc=disc,
        density=generator.uniform(700, 6100),
        angular_velocity=float(generator.uniform(80, 6000)),
        fill_ratio=largest * generator.uniform(0.02, 1.0),
    )


def _error_ratios(*, samples: tuple[_Sample, ...]) -> FloatArray:
    """|error| over half-width, shape (samples, quantities); -1 where the error is at round-off."""
    return np.array([_ratios_of(sample) for sample in samples])


def _coverage(*, ratios: FloatArray, width_factor: float = 1.0) -> Mapping[str, _Coverage]:
    """How often half-widths times a factor hold, and how tight they are, of each of `_QUANTITIES`."""
    scaled = np.where(ratios < 0, ratios, ratios / width_factor)
    return {name: _coverage_judge(scaled[:, index]) for index, name in enumerate(_QUANTITIES)}


def _ratios_of(sample: _Sample) -> list[float]:
    ring = ring_quantities(
        disc=sample.disc,
        density=sample.density,
        angular_velocity=sample.angular_velocity,
        fill_ratio=sample.fill_ratio,
    )
    if not ring.status.ok:
        raise RuntimeError(ring.status.text)
    exact = _exact(sample)
    return [_ratio(ring, name, exact[name]) for name in _QUANTITIES]


def _ratio(ring: RingQuantities, name: str, exact: float) -> float:
    estimate = getattr(ring, name)
    error = abs(float(estimate.value[0]) - exact)
    if error <= _ROUND_OFF * abs(exact):
        return -1.0
    return error / float(estimate.uncertainty[0])


def _exact(sample: _Sample) -> Mapping[str, float]:
    disc, x = sample.disc, sample.fill_ratio
    a = surface_radius(disc=disc, fill_ratio=x)
    alpha = half_angle(disc=disc, radius=a)
    pressure = exact_wall_pressure(
        disc=disc, density=sample.density, angular_velocity=sample.angular_velocity, fill_ratio=x
    )
    return {
        "liquid_volume": x * chamber_volume(disc=disc),
        "wall_pressure": float(pressure),
        "moment": float(exact_moment(disc=disc, density=sample.density, fill_ratio=x)),
        "moment_per_volume": float(sample.density * a * np.sin(alpha) / alpha),
    }


def _coverage_judge(ratios: FloatArray) -> _Coverage:
    judged = ratios[ratios >= 0]
    return _Coverage(
        share=float(np.mean(ratios <= 1)),
        tightness=float(np.median(judged)) if judged.size else 1.0,
        judged=int(judged.size),
        worst=float(judged.max()) if judged.size else 0.0,
    )


def coverage(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Do the half-widths hold the truth as often as they say, and are they no wider than they need be?

    Random discs and fills, finite elements against the closed form; a fixed seed, so the same discs every
    time.
    """
    results = _coverage(ratios=_ratios(), width_factor=_FACTORS[defect])
    found: dict[str, Found] = {}
    for name, quantity in zip(_NAMES, _QUANTITIES, strict=True):
        found[f"{name}_share"] = Found(value=results[quantity].share)
        found[f"{name}_tightness"] = Found(value=results[quantity].tightness)
    return Evidence(
        found=found,
        numbers={"samples": float(_COUNT), "worst": max(result.worst for result in results.values())},
        tables=(_coverage_table(results),),
    )


@lru_cache(maxsize=1)
def _ratios() -> FloatArray:
    return _error_ratios(samples=_random_samples(count=_COUNT, seed=_SEED))


def _coverage_table(results: Mapping[str, _Coverage]) -> Table:
    return Table(
        name=f"{_COUNT} random discs, seed {_SEED}",
        columns={
            "quantity": [name.replace("_", " ") for name in results],
            "held": [result.share for result in results.values()],
            "median error over half-width": [result.tightness for result in results.values()],
            "largest error over half-width": [result.worst for result in results.values()],
            "not at round-off": [float(result.judged) for result in results.values()],
        },
    )


_DEFECTS: Final = {
    None: SOUND,
    "half_widths_hundredth": Defect(width_factor=0.01),
    "liquid_lost": Defect(leak=1e-6),
}
_FEW: Final = Size(points=40, sweep=2, fineness=1.0)
"""Enough for a mutation to show."""
_WORKERS: Final = 2
_KEPT: Final = "extremes-points.json"
"""From which an interrupted run resumes."""
_PAPER: Final = "liquid_ring_paper"
_NUMBERS: Final = {
    "solved": Ending.SOLVED,
    "wide": Ending.WIDE,
    "status": Ending.STATUS,
    "refused": Ending.REFUSED,
}


def extremes(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The designed set and the axes of the extremes; a heavy run."""
    document = tomllib.loads(bundled_scene(_PAPER).read_text(encoding="utf-8"))
    base = Base(document=document, file=f"{_PAPER}.toml", defect=_DEFECTS[defect])
    size = SIZES[level] if defect is None else _FEW
    kept = cache_folder() / _KEPT if level == "heavy" and defect is None else None
    found = find_extremes(base, size=size, workers=_WORKERS, kept=kept)
    everything = found.everything
    endings = counted(everything)
    worst = max(j.worst_ratio for j in everything)
    return Evidence(
        found=as_found(broken=found.broken(), worst=worst),
        numbers={
            "judged": float(len(everything)),
            "points": float(len(found.points)),
            "residual": max(j.residual for j in everything),
            "worst": worst,
            **{name: float(endings[str(ending)]) for name, ending in _NUMBERS.items()},
        },
        tables=[Table(name=name, columns=columns) for name, columns in found.tables().items()],
    )
