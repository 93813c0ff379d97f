"""Liquid that sits in the connecting tube: its moment, and what an injection does to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.operating.pressure_profile import HumpProfile
from ringbalance.reduced_model.tube.path import crest_middle, path_angle
from ringbalance.scene.models import Scene


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
