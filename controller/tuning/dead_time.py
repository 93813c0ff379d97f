"""Dead time: what of a valve-open time fills gas or lifts liquid to the crest, and what is done about it.

An injection that is commanded for a share s of the gain's vector stays open for s + o, o the offset
`controller.gas_time_offset`.  With a dead time d of its chamber it moves nothing while s + o <= d, so an
amplitude stands still while both shares of its vector do.  With o = d at the balanced fills the loop factor
is what the gain says, down to the smallest residual.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from ringbalance.controller.liquid_ring.loop_factor import balanced_fills, vibration_rates
from ringbalance.controller.terms import dynamics_of, run_models, terms_modelled
from ringbalance.reduced_model.gas_line import standing_amplitude
from ringbalance.reduced_model.injection.pair import Injections
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.terms import FILLING, HELD
from ringbalance.results.rows import Finding
from ringbalance.scene.models import Scene

_DIGITS: Final = 4
"""Of an offset in s: a tenth of a millisecond."""


def dead_times(scene: Scene, model: BalancerModel) -> tuple[float, ...]:
    """Of every chamber at the balanced fills, for a correction of the size of the limit, s.

    Empty where runs model neither the filling of gas nor the lift to the crest; zero for a chamber that the
    gas cannot drive, and for all where liquid runs back, for which no longer opening makes up.
    """
    modelled = terms_modelled(run_models(scene=scene, model=model))
    if not {FILLING, HELD} & set(modelled):
        return ()
    dynamics = dynamics_of(scene=scene, model=model, modelled=modelled)
    total, half = 2 * scene.disc.initial_fill, scene.disc.chambers // 2
    fills, rates = balanced_fills(scene, model), vibration_rates(scene, model)
    driven = np.concatenate([fills, total - fills])
    injections = (
        Injections.of(dynamics, model, fill=float(x), total=total, chamber=i // half)
        for i, x in enumerate(driven)
    )
    lost = [_dead_time(scene, each, rate=b) for each, b in zip(injections, rates.T.flat, strict=True)]
    return tuple(0.0 if None in lost else round(max(each or 0.0, 0.0), _DIGITS) for each in lost)


def _dead_time(scene: Scene, injections: Injections, *, rate: float) -> float | None:
    if rate <= 0.0:
        return 0.0
    return injections.dead_time(scene.controller.limit / rate * injections.steady)


def compensated(scene: Scene, model: BalancerModel, dead: tuple[float, ...]) -> Scene:
    """The scene with its dead times as offsets where an amplitude above its limit would stand still.

    Not for the trial algorithm, whose valve-open times are the scene's.
    """
    if (
        scene.controller.kind == "trial"
        or not dead
        or dead_zone(scene, model, dead) <= scene.controller.limit
    ):
        return scene
    return replace(scene, controller=replace(scene.controller, gas_time_offset=dead))


def dead_zone(scene: Scene, model: BalancerModel, dead: Sequence[float]) -> float:
    """`standing_amplitude` at the balanced fills, m, the least valve-open time counted."""
    settings, n = scene.controller, scene.disc.chambers
    lost = [max(d - o, 0.0) for d, o in zip(dead or (0.0,) * n, settings.offsets(n), strict=True)]
    still = [max(each, settings.minimum_gas_time) for each in lost]
    rates = np.maximum(vibration_rates(scene, model).T.ravel(), 0.0)
    return standing_amplitude(settings, still, rates=rates.tolist())


def offset_text(offsets: Sequence[float]) -> str:
    """As a scene file has them."""
    each = [f'"{1e3 * offset:.4g} ms"' for offset in offsets]
    alike = len(set(each)) == 1
    return f"controller.gas_time_offset = {each[0] if alike else '[' + ', '.join(each) + ']'}"


def standing_finding(scene: Scene, model: BalancerModel) -> Finding | None:
    """The offsets that mend a dead time which leaves an amplitude above the limit where it is; else None."""
    mended = compensated(scene, model, dead_times(scene, model)).controller.gas_time_offset
    if not mended or mended == scene.controller.gas_time_offset:
        return None
    return Finding(
        code="dead_time",
        values={"standing_amplitude": dead_zone(scene, model, mended), "setting": offset_text(mended)},
        change={"controller.gas_time_offset": offset_text(mended).partition(" = ")[2]},
    )
