"""Whether a scene's tube holds a correction while the gas is off, and which siphon crest would."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ringbalance.mesh.geometry import surface_radius
from ringbalance.reduced_model.tube.flow import column_pressure, tube_path
from ringbalance.results.findings import Finding
from ringbalance.scene.models import Scene


@dataclass(frozen=True, kw_only=True)
class Holding:
    """What becomes of the fullest chamber's liquid with the gas off."""

    holds: bool
    """Whether it stays there, by `TubePath.holds`."""
    hump_radius: float | None
    """Of the scene's crest, m; None without one."""
    largest_hump_radius: float | None
    """Of a crest that holds it whatever the pressure of a cavity there, m; None: no crest does."""

    @classmethod
    def of(cls, scene: Scene, *, fill_ratio: float) -> Holding:
        """By hydrostatics, gravity left out. Args: `fill_ratio`: the largest that runs reach."""
        path, wall = tube_path(scene), scene.disc.outer_radius
        fullest = float(
            surface_radius(disc=scene.disc, fill_ratio=min(fill_ratio, scene.disc.max_fill_ratio))
        )
        level = column_pressure(scene=scene, radius=fullest)
        pull = scene.liquid.density * scene.rotor.speed**2 / 2
        square = wall**2 - path.holding_pressure(level) / pull if pull > 0 else 0.0
        return cls(
            holds=path.holds(level),
            hump_radius=scene.tube.hump_radius,
            largest_hump_radius=math.sqrt(square) if square > 0 else None,
        )

    @property
    def finding(self) -> Finding | None:
        """That a correction does not last, and the crest that would hold it; None where the tube holds."""
        if self.holds:
            return None
        if self.largest_hump_radius is None:
            return Finding(code="no_crest_holds")
        # Rounded down to a tenth of a millimetre: a crest there holds.
        crest = math.floor(1e4 * self.largest_hump_radius * (1 + 1e-12)) / 1e4
        return Finding(
            code="no_crest" if self.hump_radius is None else "crest_too_low",
            values={"crest_radius": self.hump_radius, "largest_crest_radius": crest},
            change={"tube.hump_radius": crest},
        )
