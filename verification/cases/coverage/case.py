"""Do the half-widths hold the truth as often as they say, and are they no wider than they need be?

Random discs and fills, finite elements against the closed form; a fixed seed, so the same discs every time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from ringbalance.mesh.geometry import chamber_volume, half_angle, surface_radius
from ringbalance.physics.pressure.ring import RingQuantities, ring_quantities
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Disc, Scene
from ringbalance.verification.evidence import Evidence, Found, Level, Table
from ringbalance.verification.reference.exact_chamber import exact_moment, exact_wall_pressure

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
    return {name: _judge(scaled[:, index]) for index, name in enumerate(_QUANTITIES)}


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


def _judge(ratios: FloatArray) -> _Coverage:
    judged = ratios[ratios >= 0]
    return _Coverage(
        share=float(np.mean(ratios <= 1)),
        tightness=float(np.median(judged)) if judged.size else 1.0,
        judged=int(judged.size),
        worst=float(judged.max()) if judged.size else 0.0,
    )


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    results = _coverage(ratios=_ratios(), width_factor=_FACTORS[defect])
    found: dict[str, Found] = {}
    for name, quantity in zip(_NAMES, _QUANTITIES, strict=True):
        found[f"{name}_share"] = Found(value=results[quantity].share)
        found[f"{name}_tightness"] = Found(value=results[quantity].tightness)
    return Evidence(
        found=found,
        numbers={"samples": float(_COUNT), "worst": max(result.worst for result in results.values())},
        tables=(_table(results),),
    )


@lru_cache(maxsize=1)
def _ratios() -> FloatArray:
    return _error_ratios(samples=_random_samples(count=_COUNT, seed=_SEED))


def _table(results: Mapping[str, _Coverage]) -> Table:
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
