"""The tube's path as a line of radii, and what of the loss lies before each place on it.

The scene gives three radii and where the crest lies, so both legs run straight in r from port to crest; bends
sit where they are when spread evenly along the path.  Without a crest the path stays at the port's radius.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.state import TubeState
from ringbalance.scene.arrays import BoolArray, FloatArray
from ringbalance.scene.models import Tube

_SAME = 1e-9


@dataclass(frozen=True, kw_only=True)
class Places:
    """Places along the path in its order; where something is lumped the same share stands twice."""

    share: FloatArray
    """s/L, from the giving chamber."""
    after: BoolArray
    """At a doubled share: whether this entry lies behind what is lumped there."""


def reversed_tube(tube: Tube) -> Tube:
    """The tube as the opposite chamber sees it. Returns: The tube with crest and bends from the other end."""
    return replace(tube, hump_position=1 - tube.hump_position, bends=tube.bends[::-1])


def _bend_shares(tube: Tube) -> FloatArray:
    """Where the bends sit, (i + 1/2)/n. Returns: s/L, shape (number of bends,)."""
    count = len(tube.bends)
    return (np.arange(count) + 0.5) / max(count, 1)


def places(*, tube: Tube, points: int, doubled: tuple[float, ...] = ()) -> Places:
    """Even places along the path, with its crest, and doubled at both ends, at the bends and where asked.

    Args: `points`: number of even places. `doubled`: further shares at which something changes at once.
    """
    twice = np.unique(np.concatenate([[0.0, 1.0], _bend_shares(tube), doubled]))
    kept = twice if tube.hump_radius is None else np.append(twice, tube.hump_position)
    even = np.linspace(0.0, 1.0, points)
    # An even place that differs from another by rounding only would stand for nothing.
    even = even[np.min(np.abs(even[:, None] - kept), axis=1) > _SAME]
    once = np.concatenate([even, np.setdiff1d(kept, twice)])
    share = np.concatenate([once, twice, twice])
    after = np.concatenate([np.zeros(once.size + twice.size), np.ones(twice.size)]).astype(np.bool_)
    order = np.lexsort((after, share))
    return Places(share=share[order], after=after[order])


def path_radius(*, tube: Tube, share: npt.ArrayLike) -> FloatArray:
    """Radius along the path, straight from port to crest and back."""
    if tube.hump_radius is None:
        return np.full(np.shape(share), tube.port_radius)
    radii = [tube.port_radius, tube.hump_radius, tube.port_radius]
    return np.asarray(
        np.interp(np.asarray(share, dtype=np.float64), [0.0, tube.hump_position, 1.0], radii),
        dtype=np.float64,
    )


def share_at_radius(*, tube: Tube, radius: float, far_leg: bool) -> float:
    """Where a leg passes a radius, or its end when it does not reach there."""
    hump = tube.port_radius if tube.hump_radius is None else tube.hump_radius
    inward = float(np.clip((tube.port_radius - radius) / (tube.port_radius - hump), 0.0, 1.0))
    return 1 - inward * (1 - tube.hump_position) if far_leg else inward * tube.hump_position


def loss_before(*, tube: Tube, state: TubeState, at: Places) -> FloatArray:
    """Fall of pressure from the giving chamber to each place, over rho u^2/2, without the fall in radius.

    Zero before the entrance; inside, alpha and what of k lies before; behind the exit k + 1.  In turbulent
    flow the "+1" counts alpha as 1, so the pressure there rises by the small rest at the exit.
    Source: energy balance; at the crest it is alpha and `upstream_loss`.
    """
    terms = {name: float(term) for name, term in state.terms.items()}
    along = sum(terms.get(name, 0.0) for name in ("friction", "rotation", "extra", "decree"))
    inside = float(state.kinetic_factor) + terms.get("entrance", 0.0) + along * at.share
    if "decree" not in terms:
        for share, bend in zip(_bend_shares(tube), state.bends, strict=True):
            inside = inside + float(bend) * ((at.share > share) | ((at.share == share) & at.after))
    entered = (at.share > 0) | at.after
    left = (at.share == 1) & at.after
    return np.where(left, float(state.k) + 1, np.where(entered, inside, 0.0))
