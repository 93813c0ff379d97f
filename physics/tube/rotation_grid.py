"""Where the friction table of the rotating tube has its nodes, and the coordinates it is smooth in.

Two overlapping rectangles, because no single pair of coordinates is regular in both limits:

- "slow": a = ln(1 + Kl/300), b = S/(1 + S), from S = 0 (Kl alone matters) to S = 5, Kl up to 1e7;
- "fast": a = ln(1 + R/20), b = S_min(R)/S, from 1/S = 0 (Re = 0, linear, R alone matters) to S_min(R), which
  is 2 as long as Kl = R^2/S stays below 1.05e7 and follows that bound above.

Kl = R Re, S = R/Re, R = omega d^2/nu.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray

KL_SCALE, ROTATION_SCALE = 300.0, 20.0
KL_LIMIT, ROTATION_LIMIT = 1e7, 1e5
FAST_S, FAST_KL = 2.0, 1.05e7


@dataclass(frozen=True, kw_only=True)
class TableSettings:
    """All that the table depends on."""

    slow_a: tuple[float, ...]
    slow_b: tuple[float, ...]
    fast_a: tuple[float, ...]
    fast_b: tuple[float, ...]
    around: tuple[int, ...] = (8, 12, 16)
    """Cells n of `SectionMesh`, coarse to fine; one and a half times as many across."""
    wall_ratio: float = 15.0
    formal_order: float = 4.0
    """Of the friction ratio, a functional of a velocity that converges at order 2 in its gradient."""
    newton_tolerance: float = 1e-7
    path_level: int = 1
    """Mesh on which the paths are followed; the other meshes start from its flows."""
    branch_kl: float = 7e5
    """Above this Kl further steady flows appear, and a long step may land on one of them."""
    branch_step: float = 0.06
    """Longest step in `a` above that Kl."""

    def plain(self) -> dict[str, object]:
        """As plain data, for a header. Returns: Field names and values."""
        return asdict(self)


def _rounded(values: FloatArray) -> tuple[float, ...]:
    return tuple(float(v) for v in np.round(values, 12))


def table_settings() -> TableSettings:
    """Settings of the table that comes with the package."""
    return TableSettings(
        slow_a=_rounded(np.linspace(0.0, slow_first(KL_LIMIT), 24)),
        slow_b=_rounded(np.arange(11) / 12),
        fast_a=_rounded(np.linspace(0.0, fast_first(ROTATION_LIMIT), 20)),
        fast_b=_rounded(np.linspace(0.0, 1.0, 5)),
    )


def slow_first(kl: npt.ArrayLike) -> FloatArray:
    """a = ln(1 + Kl/300).

    Args: `kl`: Kl, any shape.
    Returns: The same shape.
    """
    return np.log1p(np.asarray(kl, dtype=np.float64) / KL_SCALE)


def fast_first(rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """a = ln(1 + R/20).

    Args: `rotation_reynolds`: R, any shape.
    Returns: The same shape.
    """
    return np.log1p(np.asarray(rotation_reynolds, dtype=np.float64) / ROTATION_SCALE)


def least_s(rotation_reynolds: npt.ArrayLike) -> FloatArray:
    """S_min(R) = (2^4 + (R^2/1.05e7)^4)^(1/4), below which the fast rectangle ends.

    Args: `rotation_reynolds`: R, any shape.
    Returns: The same shape.
    """
    bound = np.asarray(rotation_reynolds, dtype=np.float64) ** 2 / FAST_KL
    return np.asarray((FAST_S**4 + bound**4) ** 0.25, dtype=np.float64)


def slow_pair(a: float, b: float) -> tuple[float, float]:
    """Kl and S of a point of the slow rectangle. Args: `a`: ln(1 + Kl/300). `b`: S/(1 + S)."""
    return float(KL_SCALE * np.expm1(a)), b / (1 - b)


def fast_pair(a: float, b: float) -> tuple[float, float]:
    """R and 1/S of a point of the fast rectangle. Args: `a`: ln(1 + R/20). `b`: S_min(R)/S."""
    rotation = float(ROTATION_SCALE * np.expm1(a))
    return rotation, float(b / least_s(rotation))
