"""Margin of a full siphon's crest pressure above the cavity pressure, with its uncertainty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ringbalance.physics.tube.loss import TubeLoss, tube_loss
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.tube.heads import velocity_of
from ringbalance.reduced_model.tube.regime import TubeEnds
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene, Tube


@dataclass(frozen=True, kw_only=True)
class DirectedState:
    """One state of the tube, in one direction of flow."""

    reverse: bool
    """Whether the opposite chamber is upstream."""
    ends: TubeEnds[float]
    """Pressures at the tube's ends."""
    upstream_uncertainty: float
    """Expanded uncertainty (95 %) of the upstream hydrostatic pressure, Pa."""
    downstream_uncertainty: float
    """The same downstream."""


def directed_state(
    *, law: CalibratedLaw, fills: tuple[float, float], gas_pressure: float, reverse: bool
) -> DirectedState:
    """Take a state in one direction of flow."""
    at = law.ends(fill_ratio=fills[0], opposite_fill_ratio=fills[1], gas_pressure=gas_pressure)
    ends = TubeEnds(
        upstream_gas=float(at.upstream_gas),
        downstream_gas=float(at.downstream_gas),
        upstream_hydrostatic=float(at.upstream_hydrostatic),
        downstream_hydrostatic=float(at.downstream_hydrostatic),
        port_pressure=law.path.port_pressure,
    )
    uncertainties = [float(law.wall_pressure_uncertainty(x)) for x in fills]
    upstream, downstream = uncertainties[::-1] if reverse else uncertainties
    return DirectedState(
        reverse=reverse,
        ends=ends.reversed() if reverse else ends,
        upstream_uncertainty=upstream,
        downstream_uncertainty=downstream,
    )


def siphon_margin(
    *, scene: Scene, tube: Tube, law: CalibratedLaw, state: DirectedState
) -> tuple[float, float] | tuple[None, None]:
    """Crest pressure of a full siphon less the cavity pressure, with its expanded uncertainty (95 %).

    p_m - p_c = p_A - p_c + P_A - D_m - R p_d,  R = (alpha + k_up)/(k + 1), p_d the driving pressure; R = 0 at
    rest
    Args: `tube`: its tube, from the upstream end. `law`: its flow law. `state`: in the direction of the
        driving pressure.
    Returns: Margin and half-width, Pa; both None without a crest.
    Source: energy balance from the upstream chamber to the crest; inputs by sensitivity, ASME V&V 20.
    """
    crest = law.path.crest
    if crest is None:
        return None, None
    driving, at_rest = state.ends.driving_pressure(), crest.separation_margin(state.ends)
    if driving <= 0:
        return at_rest, _half_width(law, state, 0.0, 0.0)
    where = np.asarray(True)
    velocity = float(velocity_of(table=law.heads.head, head=driving / law.density, where=where))
    loss = tube_loss(
        tube=tube,
        liquid=scene.liquid,
        angular_velocity=scene.rotor.speed,
        velocity=velocity,
        inputs=scene.uncertainty,
    )
    upstream = float(loss.kinetic_factor + loss.upstream_k)
    fraction = upstream / (float(loss.k.value) + 1)
    uncertainty_95 = _fraction_uncertainty(tube, loss, fraction) * driving
    return at_rest - fraction * driving, _half_width(law, state, fraction, uncertainty_95)


def _fraction_uncertainty(tube: Tube, loss: TubeLoss, fraction: float) -> float:
    """Half-width of R, moved by (s_j - R)/(k + 1) by a part of k with a fraction s_j before the crest."""
    total = float(loss.k.value) + 1
    parts: Mapping[str, FloatArray] = loss.uncertainty_parts
    squares = 0.0
    for name, part in parts.items():
        # Which end or bend is wrong is not known: then the worse of before and behind the crest.
        lumped = name in {"ends", "bends"}
        lever = max(fraction, 1 - fraction) if lumped else abs(tube.hump_position - fraction)
        squares += (lever * float(part) / total) ** 2
    return float(np.sqrt(squares))


def _half_width(law: CalibratedLaw, state: DirectedState, fraction: float, uncertainty_95: float) -> float:
    ends, crest = state.ends, law.path.hump_pressure or 0.0
    liquid = ends.upstream_hydrostatic - crest + fraction * ends.stall_pressure()
    parts = (
        uncertainty_95,
        (1 - fraction) * state.upstream_uncertainty,
        fraction * state.downstream_uncertainty,
        (1 - fraction) * law.inputs.relative_gas_pressure * ends.upstream_gas,
        law.inputs.relative_density * liquid,
        2 * law.inputs.relative_speed * liquid,
        law.inputs.hump_pressure,
        law.inputs.vapour_pressure,
    )
    return float(np.sqrt(sum(p**2 for p in parts)))
