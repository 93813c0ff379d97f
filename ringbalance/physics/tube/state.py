"""The terms of k at given velocities, without their uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.friction import (
    STRAIGHT_CRITICAL_REYNOLDS,
    critical_reynolds,
    friction_factor,
    rotation_reynolds_number,
    turbulent_friction_ratio,
)
from ringbalance.physics.tube.local_losses import (
    bend_loss,
    entrance_loss,
    exit_loss,
    kinetic_factor,
    straight_length,
)
from ringbalance.physics.tube.rotation_table import laminar_ratio
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene, Tube

_SPREAD_TERMS: Final = ("friction", "rotation", "extra", "decree")
"""Terms that are spread evenly along the path."""


@dataclass(frozen=True, kw_only=True)
class TubeState:
    """Numbers and terms of the tube's loss; arrays of one shape."""

    reynolds: FloatArray
    """Reynolds number Re."""
    rotation_reynolds: FloatArray
    """Rotation Reynolds number R_Om."""
    critical_ratio: FloatArray
    """Critical Re over the straight tube's."""
    rotating_friction: FloatArray
    """Darcy friction factor f with rotation."""
    bends: tuple[FloatArray, ...]
    """Loss coefficient K of each bend, in order along the path."""
    kinetic_factor: FloatArray
    """Kinetic-energy factor alpha."""
    terms: Mapping[str, FloatArray]
    """Summands of k."""

    @property
    def k(self) -> FloatArray:
        """Loss coefficient k, the sum of the terms."""
        return np.asarray(sum(self.terms.values()), dtype=np.float64)

    @property
    def spread_loss(self) -> FloatArray:
        """Part of k that is spread evenly along the path."""
        spread = (self.terms[name] for name in _SPREAD_TERMS if name in self.terms)
        return np.asarray(sum(spread), dtype=np.float64)

    def upstream_loss(self, share: float) -> FloatArray:
        """Part of k between the driven chamber and a point of the crest, given as a fraction of the path.

        Entrance, that share of what is spread along the path, and the bends of the first leg.  A bend belongs
        to a leg, wherever the crest is, so that the loss is continuous as the crest moves.  Both legs have
        the same number of bends; the crest halves the middle one of an odd number.
        Source: energy balance from the chamber to the crest; the scene does not say where the bends lie.
        """
        spread = share * self.spread_loss
        if "decree" in self.terms:
            return np.asarray(spread)
        before = len(self.bends) / 2
        bends = sum(min(max(before - i, 0.0), 1.0) * bend for i, bend in enumerate(self.bends))
        return np.asarray(self.terms["entrance"] + spread + bends, dtype=np.float64)


def tube_state(scene: Scene, velocity: npt.ArrayLike, *, tube: Tube | None = None) -> TubeState:
    """Every term of k at velocities above zero, m/s, any shape, for the scene's tube or another one.

    Raises: ValueError: as `straight_length`.
    """
    tube, nu = tube or scene.tube, scene.liquid.kinematic_viscosity
    return tube_state_at(
        tube=tube,
        reynolds=np.abs(np.asarray(velocity, dtype=np.float64)) * tube.bore / nu,
        rotation_reynolds=rotation_reynolds_number(
            angular_velocity=scene.rotor.speed, bore=tube.bore, kinematic_viscosity=nu
        ),
    )


def tube_state_at(*, tube: Tube, reynolds: npt.ArrayLike, rotation_reynolds: npt.ArrayLike) -> TubeState:
    """Evaluate every term of k from the two numbers that it depends on, for many liquids at once.

    Args: `rotation_reynolds`: R_Om, any shape that broadcasts to that of `reynolds`.
    Returns: TubeState, arrays of the shape of `reynolds`.
    Raises: ValueError: arcs longer than the tube.
    Source: given with each term.
    """
    re, rotation = (np.asarray(v, dtype=np.float64) for v in (reynolds, rotation_reynolds))
    rough = tube.roughness / tube.bore
    straight = friction_factor(reynolds=re, relative_roughness=rough)
    critical = critical_reynolds(rotation_reynolds=rotation) / STRAIGHT_CRITICAL_REYNOLDS
    laminar = laminar_ratio(reynolds=re, rotation_reynolds=rotation)
    turning = friction_factor(
        reynolds=re,
        relative_roughness=rough,
        laminar_ratio=laminar,
        turbulent_ratio=turbulent_friction_ratio(reynolds=re, rotation_reynolds=rotation),
        critical_ratio=critical,
    )
    # Bends of one shape are evaluated once. Numbers of many designs are arrays, which have no hash.
    shapes = [(np.asarray(b.angle).tobytes(), np.asarray(b.radius).tobytes()) for b in tube.bends]
    losses = {
        shape: bend_loss(
            bend=bend,
            bore=tube.bore,
            friction_factor=straight,
            reynolds=re,
            rotation_reynolds=rotation,
            critical_ratio=critical,
        )
        for shape, bend in dict(zip(shapes, tube.bends, strict=True)).items()
    }
    bends = tuple(losses[shape] for shape in shapes)
    if tube.drag_coefficient is not None:
        terms = {"decree": np.zeros(re.shape) + tube.drag_coefficient}
    else:
        # The arcs turn too: rotation acts on the whole length, friction without it on the straights alone.
        terms = {
            "entrance": entrance_loss(tube=tube, reynolds=re, critical_ratio=critical),
            "friction": straight_length(tube=tube) / tube.bore * straight,
            "rotation": tube.length / tube.bore * (turning - straight),
            "bends": np.asarray(sum(bends, start=np.zeros(re.shape)), dtype=np.float64),
            "exit": exit_loss(reynolds=re, critical_ratio=critical, friction_ratio=laminar),
            "extra": np.zeros(re.shape) + tube.extra_loss,
        }
    return TubeState(
        reynolds=re,
        rotation_reynolds=rotation,
        critical_ratio=critical,
        rotating_friction=turning,
        bends=bends,
        kinetic_factor=kinetic_factor(reynolds=re, critical_ratio=critical, friction_ratio=laminar),
        terms=terms,
    )
