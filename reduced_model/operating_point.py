"""Equal fills under the scene's gas pressure: flow, pressures that frame it, and the liquid in the tube."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import INPUT_PART, tube_loss
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.pressure_profile import HumpProfile
from ringbalance.reduced_model.tube import regime
from ringbalance.reduced_model.tube.path import crest_middle, path_angle
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import HumpGas, Scene


@dataclass(frozen=True, kw_only=True)
class OperatingPoint:
    """Equal fills, the scene's gas pressure, an empty tube beforehand."""

    fill_ratio: float
    """x of both chambers."""
    gas_pressure: float
    """Gauge, Pa."""
    regime: Regime
    """Of the flow."""
    velocity: float
    """u, m/s; zero when blocked."""
    velocity_uncertainty: float
    """Expanded uncertainty (95 %), m/s."""
    loss_velocity: float
    """Velocity at which k is given: u or, when blocked, that of a primed tube, m/s; zero if none."""
    k: float | None
    """Loss coefficient there; None without any velocity."""
    k_uncertainty: float | None
    """Expanded uncertainty (95 %)."""
    k_model_uncertainty: float | None
    """Its part by correlations, without the inputs."""
    priming_vented: float | None
    """Gauge pressure that starts a flow, crest gas vented, driven chamber empty, Pa; None: no crest."""
    priming_trapped: float | None
    """The same with that gas trapped, at equal fills."""
    stall: float
    """Gauge pressure at which a full siphon stalls with the driven chamber empty, Pa."""
    stall_paper: float
    """The same by Eq. 19."""
    hump_pressure: float | None
    """Pressure over the crest, gauge, Pa; None: no crest."""
    cavity_pressure: float | None
    """At which the column separates there, gauge, Pa."""
    cavitation_margin: float | None
    """Pressure over the crest of a full siphon, of a primed tube when blocked, less `cavity_pressure`, Pa."""
    cavitation_margin_uncertainty: float | None
    """Expanded uncertainty (95 %), Pa."""

    @classmethod
    def of(cls, *, scene: Scene, law: CalibratedLaw) -> OperatingPoint:
        """Evaluate the law at equal fills under the scene's gas pressure.

        Source: the law itself; thresholds by hydrostatics.
        """
        x, pressure = law.max_fill_ratio / 2, scene.gas.pressure
        flow = law.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure)
        full = law.evaluate(fill_ratio=x, opposite_fill_ratio=x, gas_pressure=pressure, primed=True)
        u = abs(float(flow.velocity)) or abs(float(full.velocity))
        loss = tube_loss(scene, u) if u > 0 else None
        hump = HumpProfile.of(scene=scene, law=law, fill_ratio=x, opposite_fill_ratio=x, points=2)
        vented = priming_pressure(law=law, fill_ratio=0.0, hump_gas="vented")
        trapped = priming_pressure(law=law, fill_ratio=x, opposite_fill_ratio=x, hump_gas="trapped")
        return cls(
            fill_ratio=x,
            gas_pressure=pressure,
            regime=Regime(int(flow.regime)),
            velocity=float(flow.velocity),
            velocity_uncertainty=float(flow.uncertainty),
            loss_velocity=u,
            k=None if loss is None else float(loss.k.value),
            k_uncertainty=None if loss is None else float(loss.k.uncertainty),
            k_model_uncertainty=None if loss is None else _model_part(loss.uncertainty_parts),
            priming_vented=None if vented is None else float(vented),
            priming_trapped=None if trapped is None else float(trapped),
            stall=max(float(regime.stall_pressure(law.path, law.ends(fill_ratio=0.0))) / law.gas_factor, 0.0),
            stall_paper=paper.stall_pressure(
                disc=scene.disc, density=scene.liquid.density, angular_velocity=scene.rotor.speed
            ),
            hump_pressure=hump.hump_pressure,
            cavity_pressure=hump.cavity_pressure,
            cavitation_margin=hump.cavitation_margin,
            cavitation_margin_uncertainty=hump.cavitation_margin_uncertainty,
        )


def priming_pressure(
    *,
    law: CalibratedLaw,
    fill_ratio: npt.ArrayLike,
    opposite_fill_ratio: npt.ArrayLike | None = None,
    hump_gas: HumpGas,
) -> FloatArray | None:
    """Gas pressure that primes the tube: it lifts the liquid over the siphon crest.

    vented: rho omega^2 (a_A^2 - r_m^2)/2; trapped: that and rho omega^2 (r_p^2 - a_C^2)/2.
    Args: `law`: the flow law. `fill_ratio`: x of the driven chamber, any shape. `opposite_fill_ratio`: of the
        opposite chamber; default max_fill_ratio - fill_ratio. `hump_gas`: which of the two bounds, whatever
        the law itself uses.
    Returns: Gauge pressure, Pa, of the broadcast shape; None without a crest.
    Source: hydrostatics of the two legs in the rotating frame. For the liquid-ring paper's disc a crest at
        31.5 mm gives its 0.54 MPa, vented with the driven chamber nearly empty or trapped at equal fills: an
        inference, because the paper does not say what its figure means.
    """
    if not law.path.crest:
        return None
    path = replace(law.path, trapped=hump_gas == "trapped")
    ends = law.ends(fill_ratio=fill_ratio, opposite_fill_ratio=opposite_fill_ratio)
    return np.asarray(regime.priming_pressure(path, ends)) / law.gas_factor


def _model_part(parts: Mapping[str, FloatArray]) -> float:
    return math.hypot(*(float(part) for name, part in parts.items() if not name.startswith(INPUT_PART)))


@dataclass(frozen=True, kw_only=True)
class _HeldLiquid:
    """Liquid in a tube in one state."""

    state: str
    """ "full", "separated" (a cavity between the legs), or "legs" (gas between them)."""
    mass: float
    """kg."""
    along: float
    """Moment towards the driven chamber, kg m."""
    across: float
    """Moment a quarter of a turn ahead of it, towards the crest, kg m."""
    rounding: float
    """Of the moment, at most, kg m."""

    @property
    def moment(self) -> complex:
        """Along and across, kg m."""
        return complex(self.along, self.across)

    def change_from(self, before: _HeldLiquid) -> float:
        """Size of the difference of two moments, kg m; zero where that is rounding."""
        change = abs(self.moment - before.moment)
        return change if change > self.rounding + before.rounding else 0.0


@dataclass(frozen=True, kw_only=True)
class TubeLiquid:
    """Liquid in the tube of a pair around its first injection, at equal fills."""

    before: _HeldLiquid
    """At rest, gas over the crest."""
    flowing: _HeldLiquid
    """Under the scene's gas pressure."""
    after: _HeldLiquid
    """At rest after venting: a column that stays whole, or legs on both sides of a cavity or of gas."""
    flowing_vibration: float
    """Change of the vibration's amplitude while the tube flows, at most, m."""
    lasting_vibration: float
    """The same that stays after venting, m."""
    limit: float
    """Of the vibration, m."""
    returned_volume: float
    """Liquid that each injection lifts to the middle of the crest and that falls back when the gas is vented,
    m^3; runs lift it from the level, where gas lies over the crest."""

    @classmethod
    def of(cls, scene: Scene, *, law: CalibratedLaw) -> TubeLiquid:
        """Follow the liquid in the tube through an injection at equal fills.

        M = rho S int r e^(i phi) ds over the part of the path that is full, where pressure at rest or in flow
        puts the ends of the columns.  The chambers' levels change too little in one injection to matter.
        Source: first moment; `HumpProfile.of`.
        """
        fill, gas = law.max_fill_ratio / 2, scene.gas.pressure

        def state(gas_pressure: float, *, primed: bool) -> HumpProfile:
            return HumpProfile.of(
                scene=scene, law=law, fill_ratio=fill, gas_pressure=gas_pressure, primed=primed
            )

        primes = law.evaluate(fill_ratio=fill, gas_pressure=gas).primed
        profiles = state(0.0, primed=False), state(gas, primed=False), state(0.0, primed=bool(primes))
        before, flowing, after = (_held(scene, profile) for profile in profiles)
        influence = scene.rotor.influence_coefficient
        return cls(
            before=before,
            flowing=flowing,
            after=after,
            flowing_vibration=influence * flowing.change_from(before),
            lasting_vibration=influence * after.change_from(before),
            limit=scene.controller.limit,
            returned_volume=_returned(scene, flowing=profiles[1], after=profiles[2]),
        )

    @property
    def above_limit(self) -> bool:
        """Whether what stays in the tube changes the vibration by more than the controller's limit."""
        return self.lasting_vibration > self.limit


def _held(scene: Scene, profile: HumpProfile) -> _HeldLiquid:
    share = profile.path / scene.tube.length
    arm = profile.radius * np.exp(1j * path_angle(tube=scene.tube, share=share))
    # A piece counts where both of its ends are full; where fullness changes a place stands twice.
    wet = profile.full[1:] & profile.full[:-1]
    line = scene.liquid.density * scene.tube.area * np.diff(profile.path) * wet
    pieces = line * (arm[1:] + arm[:-1]) / 2
    moment = complex(np.sum(pieces))
    return _HeldLiquid(
        state=_state(profile),
        mass=float(np.sum(line)),
        along=moment.real,
        across=moment.imag,
        rounding=pieces.size * float(np.finfo(float).eps * np.sum(np.abs(pieces))),
    )


def _state(profile: HumpProfile) -> str:
    if np.all(profile.full):
        return "full"
    gap = profile.pressure[~profile.full]
    cavity = profile.cavity_pressure
    return "separated" if cavity is not None and float(np.max(gap)) <= cavity + 1.0 else "legs"


def _returned(scene: Scene, *, flowing: HumpProfile, after: HumpProfile) -> float:
    """Volume between where the near column ends at rest and the crest's middle; none in a full tube.

    What lies on the crest's circle is pulled to neither side and drains to both.
    """
    if flowing.velocity == 0 or scene.tube.hump_radius is None or np.all(after.full):
        return 0.0
    near = float(after.path[int(np.argmin(after.full))])
    parts = crest_middle(scene.tube) * scene.tube.length
    return scene.tube.area * max(parts - near, 0.0)
