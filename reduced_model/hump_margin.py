"""How far a full siphon's pressure over the hump stays above the cavity pressure, and how surely."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube_loss import TubeLoss, tube_loss
from ringbalance.reduced_model.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tube_heads import velocity_of
from ringbalance.scene.models import Scene, Tube

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Ends:
    """The giving and the receiving chamber of one state."""

    reverse: bool
    """Whether the opposite chamber gives."""
    gas: float
    """In the giving chamber, gauge, Pa."""
    back_gas: float
    """In the receiving chamber, gauge, Pa."""
    level: float
    """Liquid pressure at the giving chamber's outer wall, over its gas, Pa."""
    back_level: float
    """The same of the receiving chamber, Pa."""
    level_spread: float
    """95 % half-width of `level`, Pa."""
    back_spread: float
    """95 % half-width of `back_level`, Pa."""

    def surplus(self, law: CalibratedLaw) -> float:
        """rho (H_giving - H_receiving), Pa.

        Args:
            law: the flow law.

        Returns:
            What drives a full siphon, Pa.
        """
        back = max(self.back_level, law.path.port_pressure)
        return self.gas - self.back_gas + self.level - back

    def cavity(self, law: CalibratedLaw) -> float:
        """Pressure of a cavity over the hump, gauge, Pa.

        Args:
            law: the flow law.

        Returns:
            The vapour pressure, or the receiving chamber's gas pressure when its level has left the port.
        """
        return self.back_gas if self.back_level < law.path.port_pressure else law.path.vapour_pressure


def ends(*, law: CalibratedLaw, fills: tuple[float, float], gas_pressure: float, reverse: bool) -> Ends:
    """The chambers of a state, in the direction asked for.

    Args:
        law: the flow law.
        fills: fill ratios of the driven and the opposite chamber.
        gas_pressure: gauge, Pa, in the driven chamber.
        reverse: whether the opposite chamber gives.

    Returns:
        Ends.
    """
    level, other = (max(float(law.wall_pressure(x)), 0.0) for x in fills)
    spread, other_spread = (float(law.wall_pressure_spread(x)) for x in fills)
    sides = [(gas_pressure, level, spread), (0.0, other, other_spread)]
    giving, receiving = sides[::-1] if reverse else sides
    return Ends(
        reverse=reverse,
        gas=giving[0],
        level=giving[1],
        level_spread=giving[2],
        back_gas=receiving[0],
        back_level=receiving[1],
        back_spread=receiving[2],
    )


def siphon_margin(
    *, scene: Scene, tube: Tube, law: CalibratedLaw, state: Ends
) -> tuple[float, float] | tuple[None, None]:
    """Pressure of a full siphon over the hump, less the cavity pressure, with its 95 % half-width.

    p_m - p_c = p_A - p_c + P_A - D_m - R s,  R = (alpha + k_up)/(k + 1), s = surplus; R = 0 at rest

    Args:
        scene: the scene.
        tube: its tube, as the giving chamber sees it.
        law: its flow law.
        state: the chambers, in the direction in which the surplus drives.

    Returns:
        Margin and half-width, Pa; both None without a hump.

    Source: energy balance from the giving chamber to the hump; uncertain inputs by sensitivity, ASME V&V 20.
    """
    hump = law.path.hump_pressure
    if hump is None:
        return None, None
    surplus = state.surplus(law)
    at_rest = state.gas - state.cavity(law) + state.level - hump
    if surplus <= 0:
        return at_rest, _half_width(law, state, 0.0, 0.0)
    where = np.asarray(True)
    velocity = float(velocity_of(table=law.heads.head, head=surplus / law.density, where=where))
    loss = tube_loss(
        tube=tube,
        liquid=scene.liquid,
        angular_velocity=scene.rotor.speed,
        velocity=velocity,
        inputs=scene.uncertainty,
    )
    upstream = float(loss.kinetic_factor + loss.upstream_k)
    share = upstream / (float(loss.k.value) + 1)
    spread = _share_spread(tube, loss, share) * surplus
    return at_rest - share * surplus, _half_width(law, state, share, spread)


def _share_spread(tube: Tube, loss: TubeLoss, share: float) -> float:
    """Half-width of R: what a part of k lying before the hump by a share s_j moves is (s_j - R)/(k + 1)."""
    total = float(loss.k.value) + 1
    parts: Mapping[str, FloatArray] = loss.uncertainty_parts
    squares = 0.0
    for name, part in parts.items():
        # Which end or bend is wrong is not known: then the worse of before and behind the hump.
        lumped = name in {"ends", "bends"}
        lever = max(share, 1 - share) if lumped else abs(tube.hump_position - share)
        squares += (lever * float(part) / total) ** 2
    return float(np.sqrt(squares))


def _half_width(law: CalibratedLaw, state: Ends, share: float, spread: float) -> float:
    hump = law.path.hump_pressure or 0.0
    liquid = state.level - hump - share * (state.level - max(state.back_level, law.path.port_pressure))
    parts = (
        spread,
        (1 - share) * state.level_spread,
        share * state.back_spread,
        (1 - share) * law.inputs.relative_gas_pressure * state.gas,
        law.inputs.relative_density * liquid,
        2 * law.inputs.relative_speed * liquid,
        law.inputs.hump_pressure,
        law.inputs.vapour_pressure,
    )
    return float(np.sqrt(sum(p**2 for p in parts)))
