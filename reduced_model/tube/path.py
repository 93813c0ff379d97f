"""Path of the tube as radii over its length, and the part of the loss before each point of it.

A crest shaped as an arc: straight legs from the ports touch the crest's circle, which the tube follows in
between, as the shortest path between opposite ports does; a longer tube is taken as that path stretched.  A
crest shaped as a point: both legs run straight in r.  A bend belongs to a leg and stays at its fraction of it
when the crest moves.  Without a crest the path stays at the port's radius.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.state import TubeState
from ringbalance.scene.arrays import BoolArray, FloatArray, plain
from ringbalance.scene.fitted import CREST_ERROR
from ringbalance.scene.keys.derivations import shortest_path
from ringbalance.scene.models import Scene, Tube
from ringbalance.scene.uncertain import NORMAL_95

_SAME = 1e-9


@dataclass(frozen=True, kw_only=True)
class Places:
    """Points along the path, in order; a point with a lumped loss stands twice."""

    share: FloatArray
    """Fraction s/L of the path, from the giving chamber."""
    after: BoolArray
    """True for the second entry of a doubled point, behind the loss lumped there."""

    @classmethod
    def even(cls, *, tube: Tube, points: int, doubled: tuple[float, ...] = ()) -> Places:
        """Evenly spaced points and those of the crest, doubled at both ends, at the bends and at `doubled`.

        Args: `points`: number of evenly spaced points. `doubled`: fractions s/L of further jumps.
        """
        twice = np.unique(np.concatenate([[0.0, 1.0], *_bend_shares(tube), doubled]))
        crest = () if tube.hump_radius is None else crest_span(tube)
        exact = np.append(twice, crest)
        even = np.linspace(0.0, 1.0, points)
        # An even point that differs from another only by rounding is left out.
        even = even[np.min(np.abs(even[:, None] - exact), axis=1) > _SAME]
        once = np.concatenate([even, np.unique([share for share in crest if share not in twice])])
        share = np.concatenate([once, twice, twice])
        after = np.concatenate([np.zeros(once.size + twice.size), np.ones(twice.size)]).astype(np.bool_)
        order = np.lexsort((after, share))
        return cls(share=share[order], after=after[order])

    def loss_before(self, *, tube: Tube, state: TubeState) -> FloatArray:
        """Pressure drop from the giving chamber to each point, over rho u^2/2, without that by the radius.

        Zero before the entrance; inside, alpha and the part of k before the point; behind the exit k + 1.  In
        turbulent flow the "+1" takes alpha as 1, so the pressure rises at the exit by the small difference.
        Source: energy balance; at the crest it is alpha and `upstream_loss`.
        """
        entrance = float(state.terms.get("entrance", np.zeros(())))
        inside = float(state.kinetic_factor) + entrance + float(state.spread_loss) * self.share
        if "decree" not in state.terms:
            for first, second, bend in zip(*_bend_shares(tube), state.bends, strict=True):
                halves = [
                    (self.share > share) | ((self.share == share) & self.after) for share in (first, second)
                ]
                inside = inside + float(bend) / 2 * np.sum(halves, axis=0)
        entered = (self.share > 0) | self.after
        left = (self.share == 1) & self.after
        return np.where(left, float(state.k) + 1, np.where(entered, inside, 0.0))


def reversed_tube(tube: Tube) -> Tube:
    """The tube with its crest and bends counted from the opposite chamber."""
    errors = tuple(
        replace(each, even=-each.even) if each.cause == CREST_ERROR else each for each in tube.model_errors
    )
    return replace(tube, hump_position=1 - tube.hump_position, bends=tube.bends[::-1], model_errors=errors)


def crest_span(tube: Tube) -> tuple[float, float]:
    """Fractions of the path between which the tube lies on the crest's circle; equal for a point.

    The arc takes r_m (pi - 2 acos(r_m/r_p)) of the shortest path, and `hump_position` divides what is left.
    Friction continues at the crest's radius, so the pressure falls up to the second fraction.  The length
    beyond that of the shortest path may lie anywhere, in the extreme all of it before or all of it behind the
    crest: model error `CREST_ERROR`, from -1.96 to 1.96.
    """
    if tube.hump_radius is None or tube.hump_shape == "point":
        return tube.hump_position, tube.hump_position
    port, crest = tube.port_radius, tube.hump_radius
    shortest = shortest_path(port_radius=port, hump_radius=crest, separation=math.pi)
    arc = plain(crest * (math.pi - 2 * np.arccos(np.minimum(crest / port, 1.0))) / shortest)
    error = tube.model_error(CREST_ERROR) / NORMAL_95
    span = tube.hump_position * (1 - arc), tube.hump_position + (1 - tube.hump_position) * arc
    if np.all(error == 0) or np.all(arc == 0):
        return span
    slack, error = np.maximum(1 - shortest / tube.length, 0.0), np.clip(error, -1.0, 1.0)
    # Parabola through both extremes and the stretched path, smooth at zero error.
    start, end = (
        plain(
            np.clip(
                share + slack * (error / 2 + error**2 * (0.5 - share)),
                share * (1 - slack),
                share * (1 - slack) + slack,
            )
        )
        for share in span
    )
    return start, end


def crest_middle(tube: Tube) -> float:
    """Fraction of the path at the middle of the crest, where liquid that is pulled to neither side parts."""
    return sum(crest_span(tube)) / 2


def crest_head(
    *, scene: Scene, tube: Tube, state: TubeState, velocity: FloatArray, lowest: bool = True
) -> FloatArray:
    """Head from the giving chamber to the lowest pressure at the crest, or to its arc's end, m^2/s^2."""
    kinetic = velocity**2 / 2
    fall = (state.kinetic_factor + state.upstream_loss(crest_span(tube)[1])) * kinetic
    if not lowest:
        return np.asarray(fall)
    behind = head_behind_crest(tube=tube, loss=state.spread_loss * kinetic, square=scene.rotor.speed**2)
    return np.asarray(fall + behind)


def head_behind_crest(*, tube: Tube, loss: FloatArray, square: float | FloatArray) -> FloatArray:
    """Head by which the pressure still falls behind the arc's end, where the leg rises slowest, m^2/s^2.

    The far leg loses A o and gains B o^2/2, o from 0 on the circle to 1 at the port, so the fall is
    A o - B o^2/2 at o = min(A/B, 1); A = `loss` (1 - s), B = omega^2 (r_p^2 - r_m^2).
    Args: `loss`: head lost along the whole path. `square`: omega^2; both may be over the same u^2/2.
    """
    loss, rise = _far_leg(tube, loss, square)
    outward = np.minimum(loss / rise, 1.0)
    return np.asarray(loss * outward - rise * outward**2 / 2)


def lowest_place(tube: Tube, loss: float, square: float) -> float:
    """Fraction s/L of the path at which the pressure of a full tube is lowest; as `head_behind_crest`."""
    end, (leg_loss, rise) = crest_span(tube)[1], _far_leg(tube, np.asarray(loss), square)
    return end + (1 - end) * min(float(leg_loss / rise), 1.0)


def _far_leg(
    tube: Tube, loss: FloatArray, square: float | FloatArray
) -> tuple[FloatArray, float | FloatArray]:
    """A and B of `head_behind_crest`; A is zero for a leg that runs straight in r and so rises at once."""
    if tube.hump_radius is None or tube.hump_shape == "point":
        return np.zeros_like(loss), 1.0
    return loss * (1 - crest_span(tube)[1]), square * (tube.port_radius**2 - tube.hump_radius**2)


def _bend_shares(tube: Tube) -> tuple[FloatArray, FloatArray]:
    """Fractions s/L of both halves of every bend: (i + 1/2)/n of both legs together, or of a plain tube.

    The halves of a bend in the middle sit at both ends of the crest.
    """
    count = len(tube.bends)
    even = (np.arange(count) + 0.5) / max(count, 1)
    if tube.hump_radius is None:
        return even, even
    start, end = crest_span(tube)
    near, far = 2 * even * start, end + (2 * even - 1) * (1 - end)
    return np.where(even <= 0.5, near, far), np.where(even < 0.5, near, far)


def path_radius(*, tube: Tube, share: npt.ArrayLike) -> FloatArray:
    """Radius at fractions s/L of the path, m."""
    if tube.hump_radius is None:
        return np.full(np.shape(share), tube.port_radius)
    start, end = crest_span(tube)
    outward = np.interp(np.asarray(share, dtype=np.float64), [0.0, start, end, 1.0], [1.0, 0.0, 0.0, 1.0])
    if tube.hump_shape == "point":
        return np.asarray(tube.hump_radius + (tube.port_radius - tube.hump_radius) * outward)
    square = tube.port_radius**2 - tube.hump_radius**2
    return np.asarray(np.sqrt(tube.hump_radius**2 + square * outward**2))


def share_at_radius(*, tube: Tube, radius: float, far_leg: bool) -> float:
    """Fraction s/L of the path where a leg passes a radius, or of its end if it does not reach the radius.

    Raises: ValueError: a tube without a crest.
    """
    crest, port = tube.hump_radius, tube.port_radius
    if crest is None:
        raise ValueError("a tube without a siphon crest has no legs")
    out = (radius - crest) / (port - crest)
    if tube.hump_shape == "arc":
        out = math.sqrt(max(radius**2 - crest**2, 0.0) / (port**2 - crest**2))
    inward, (start, end) = 1 - min(max(out, 0.0), 1.0), crest_span(tube)
    return 1 - inward * (1 - end) if far_leg else inward * start
