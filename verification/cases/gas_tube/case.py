"""The paper's chamber with a real gas tube: a mesh from CAD against the sector less a cylinder."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from ringbalance.mesh.geometry import (
    chamber_volume,
    half_angle,
    liquid_area,
    liquid_first_moment,
    surface_radius,
)
from ringbalance.reduced_model.chamber.values import chamber_closed_forms, drawing_shares
from ringbalance.scene import liquid_ring_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import with_value
from ringbalance.verification.cases.claim_18_gas_hole.case import compute as judge_hole
from ringbalance.verification.evidence import Evidence, Found, Level, Reference, from_half_width

_FILE: Final = Path(__file__).parent / "data" / "scene.toml"
_RADIUS, _TIP = 2e-3, 31e-3
"""Of the tube outside, and radius of its mouth, m; as tools/example_chambers.py draws them."""
_DEEP: Final = 0.8
"""Fill ratio at which part of the tube is under the surface."""


@dataclass(frozen=True, kw_only=True)
class _Exact:
    """The sector between plates less a cylinder along x, by quadrature over y; no mesh."""

    scene: Scene
    radius: float
    """Of the cylinder, m; 0 for the bare sector."""

    def _over_tube(self, inside: Callable[[float], float]) -> float:
        if self.radius == 0:
            return 0.0
        width = 2 * self.radius

        def chord(angle: float) -> float:
            # y = radius sin(angle) takes the root at the cylinder's sides away.
            y = self.radius * math.sin(angle)
            return width * math.cos(angle) * inside(y) * self.radius * math.cos(angle)

        return float(quad(chord, -math.pi / 2, math.pi / 2, epsrel=1e-12, epsabs=0, limit=400)[0])

    def volume(self, a: float) -> float:
        """Outside a surface, m^3."""
        disc = self.scene.disc
        tube = self._over_tube(lambda y: max(_TIP - math.sqrt(a * a - y * y), 0.0))
        return disc.axial_width * float(liquid_area(disc=disc, surface_radius=a)) - tube

    def moment(self, a: float) -> float:
        """Along x, kg m."""
        disc = self.scene.disc
        tube = self._over_tube(lambda y: max(_TIP**2 - (a * a - y * y), 0.0) / 2)
        sector = disc.axial_width * float(liquid_first_moment(disc=disc, surface_radius=a))
        return self.scene.liquid.density * (sector - tube)

    def lever(self, a: float) -> float:
        """lambda, twice the mean of x over the free surface, m."""
        disc, alpha = self.scene.disc, float(half_angle(disc=self.scene.disc, radius=a))

        def there(y: float) -> float:
            return 1.0 if math.sqrt(a * a - y * y) < _TIP else 0.0

        area = 2 * a * alpha * disc.axial_width
        along = 2 * a * a * math.sin(alpha) * disc.axial_width
        area -= self._over_tube(lambda y: there(y) * a / math.sqrt(a * a - y * y))
        along -= self._over_tube(lambda y: there(y) * a)
        return 2 * along / area

    def surface(self, fill: float) -> float:
        """Radius of the free surface at a fill ratio, m."""
        disc = self.scene.disc
        wanted = fill * self.volume(disc.inner_radius)
        return float(
            brentq(lambda a: self.volume(a) - wanted, disc.inner_radius, disc.outer_radius, xtol=1e-14)
        )


def reference(scene: Scene) -> Mapping[str, Reference]:
    exact = _Exact(scene=scene, radius=_RADIUS)
    half, full, deep = (exact.surface(x) for x in _fills(scene))
    values = {
        "volume": exact.volume(scene.disc.inner_radius),
        "moment": exact.moment(full),
        "moment_deep": exact.moment(deep),
        "lever": exact.lever(half),
    }
    return {name: Reference(value=value) for name, value in values.items()}


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Totals of the mesh, and what the tube changes. Raises: SceneError: the file of the case is damaged."""
    own = _with_tube(scene)
    if defect == "without_the_tube":
        own = scene
    if defect == "drawn_too_wide":
        width = 1.001 * own.disc.axial_width
        own = with_value(scene=own, quantity="axial_width", value=width)
    fills = np.array(_fills(scene))
    _, moment, ratio = chamber_closed_forms(scene=own, fill_ratio=fills)
    shares = drawing_shares(own.disc, fills)
    volume = chamber_volume(disc=own.disc)

    def found(value: float, share: float) -> Found:
        return Found(value=value, numerical=from_half_width((share + 1e-8) * abs(value)))

    bare, tube = _Exact(scene=scene, radius=0.0), _Exact(scene=scene, radius=_RADIUS)
    hole = judge_hole(_with_tube(scene), level)
    return Evidence(
        found={
            "volume": found(volume, shares.volume),
            "moment": found(float(moment[1]), float(shares.moment[1])),
            "moment_deep": found(float(moment[2]), float(shares.moment[2])),
            "lever": found(float(ratio[0]), float(shares.moment[0])),
        },
        numbers={
            "volume_change": _change(bare, tube, lambda exact: exact.volume(scene.disc.inner_radius)),
            "moment_change": _change(bare, tube, lambda exact: exact.moment(exact.surface(fills[1]))),
            "lever_change": _change(bare, tube, lambda exact: exact.lever(exact.surface(fills[0]))),
            "thickness": 2 * _RADIUS,
            "tip": _TIP,
            "ring_radius": float(surface_radius(disc=scene.disc, fill_ratio=scene.disc.max_fill_ratio)),
            "safe_stopped": hole.numbers["safe_stopped"],
            "safe_running": hole.numbers["safe_running"],
        },
    )


def _fills(scene: Scene) -> tuple[float, float, float]:
    """Equal fills, the largest, and a deep one."""
    return scene.disc.max_fill_ratio / 2, scene.disc.max_fill_ratio, _DEEP


def _change(bare: _Exact, tube: _Exact, of: Callable[[_Exact], float]) -> float:
    return of(tube) / of(bare) - 1


@lru_cache(maxsize=1)
def _disc_with_tube() -> Scene:
    return liquid_ring_scene(load_scene(_FILE))


def _with_tube(scene: Scene) -> Scene:
    """The scene with the case's chamber."""
    return replace(scene, disc=_disc_with_tube().disc)
