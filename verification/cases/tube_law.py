"""Claims on k and on the assumptions of Eqs. 13 to 18 about the tube, by the program's own tube law.

Velocities are those of a full tube under a given head, and k is that at such a velocity.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from ringbalance.physics.tube.loss import TubeLoss, tube_loss
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reduced_model.law.paper_law import paper_law
from ringbalance.reduced_model.paper import PAPER_DRAG_COEFFICIENT
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.scene.liquids import liquid_at, liquids_at_room_temperature
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import (
    CaseTable,
    Evidence,
    FigureCurve,
    Found,
    Level,
    Reference,
    Series,
    as_found,
    figure,
    from_half_width,
)
from ringbalance.verification.loops import flow_law_of
from ringbalance.verification.papers import fig_7_readings
from ringbalance.verification.reference.chambers import wall_pressure_of

_PRESSURES: Final = np.geomspace(0.77, 2.53, 9)
"""Gas pressures over the scene's."""
_FILLS: Final = np.linspace(0.02, 1.0, 50)
"""Fills over the largest."""
_MIN_HEAD: Final = 0.05
"""Smallest head over that of the gas pressure; below it the flow is close to its stall."""
_PRINTED_K: Final = Reference(
    value=PAPER_DRAG_COEFFICIENT, uncertainty=from_half_width(0.1 * PAPER_DRAG_COEFFICIENT)
)
"""Printed k, "about 50": within 10 %."""
_BORES: Final = (0.5, 0.75, 1.0, 1.5, 2.0)
"""Bores over the scene's."""
_MIN_BORE_RATIO: Final = 0.1
"""Smallest bore searched for k = 50, over the scene's."""
_WARM_K: Final = 333.15
_OIL: Final = "silicone oil 100 cSt"
_OIL_TABLE_K: Final = 298.15
"""Temperature of the data of the oil."""
_FIGURE_VELOCITIES: Final = (1e-4, 3000.0, 401)
"""Ends and number of the figure's velocities, m/s."""


def _driving_heads(scene: Scene, shares: npt.ArrayLike) -> tuple[float, ...]:
    """Heads between two chambers, H = [p0 + p_wall(x) - p_wall(x_max - x)]/rho, m^2/s^2.

    No less than a twentieth of that of the gas pressure, so that the flow does not stall.
    Args: `shares`: fills of the driven chamber in units of the largest.
    """
    share, gas = np.asarray(shares, dtype=np.float64), scene.gas.pressure
    driven, other = wall_pressure_of(scene, np.array([share, 1 - share]) * scene.disc.max_fill_ratio)
    heads = np.maximum(gas + driven - other, _MIN_HEAD * gas) / scene.liquid.density
    return tuple(heads.tolist())


@lru_cache(maxsize=64)
def _running(scene: Scene, heads: tuple[float, ...]) -> TubeLoss:
    """Loss of a full tube at the velocities with (k(u) + 1) u^2/2 = head, m^2/s^2, above zero."""
    return tube_loss(scene, TubeHeads.of(scene).velocity(heads))


def _under_gas(scene: Scene) -> TubeLoss:
    """Loss at equal fills, where gas alone drives."""
    return _running(scene, (scene.gas.pressure / scene.liquid.density,))


def bernoulli_ends(scene: Scene) -> Evidence:
    """Effects of one k and of a full tube; the exit's effect does not depend on assumed inputs."""
    heads = _driving_heads(scene, [0.5, 0.0, 0.25, 0.75, 1.0])
    runs = _running(scene, heads)
    k, half_width = float(runs.k.value[0]), float(runs.k.uncertainty[0])
    worst = float(np.max(np.abs(np.sqrt(2 * np.array(heads[1:]) / (k + 1)) / runs.velocity[1:] - 1)))
    # k's own uncertainty is common to all velocities, so it only scales the difference.
    one_k = Found(value=worst, input=from_half_width(worst * half_width / (k + 1)))
    return Evidence(quantities={"one_k": one_k} | as_found(siphon_share=_siphon_share(scene)))


def bernoulli(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """The three assumptions of Eqs. 13 to 18: one k, '+1', and a tube that runs full."""
    middle = _running(scene, _driving_heads(scene, [0.5]))
    k, exit_loss = float(middle.k.value[0]), float(middle.terms.get("exit", np.zeros(1))[0])
    law, (_, bare) = flow_law_of(scene), fig_7_readings()
    fills = _FILLS * law.max_fill_ratio
    flow = law.evaluate(fill_ratio=fills, gas_pressure=scene.gas.pressure, primed=False)
    one_k = np.sqrt(2 * np.array(_driving_heads(scene, _FILLS)) / (k + 1))
    shown = figure(
        "velocity at the scene's gas pressure",
        ("fill ratio", "1", fills),
        FigureCurve("calibrated law", "m/s", flow.velocity, uncertainty=flow.uncertainty),
        FigureCurve("Eq. 14 with one k", "m/s", one_k, style="paper"),
    )
    # The exit's excess over '+1' changes the velocity by half its fraction of k + 1.
    by_exit = as_found(exit_velocity=abs(exit_loss) / (2 * (k + 1)))
    return Evidence(
        quantities={**bernoulli_ends(scene).quantities, **by_exit},
        numbers={"exit_excess": exit_loss, "bare_bore": bare.tube.bore, "share_bare": _siphon_share(bare)},
        series=(shown,),
    )


def _siphon_share(scene: Scene) -> float:
    law = flow_law_of(scene)
    flow = law.evaluate(
        fill_ratio=_FILLS[:, None] * law.max_fill_ratio,
        gas_pressure=_PRESSURES[None, :] * scene.gas.pressure,
        primed=False,
    )
    return float(np.mean(flow.regime == Regime.SIPHON))


def drag_coefficient_ends(scene: Scene) -> Evidence:
    """k at equal fills, and its spread over the fills."""
    middle = _running(scene, _driving_heads(scene, [0.5]))
    fills = _over_fills(scene).k
    low, high = int(np.argmin(fills.value)), int(np.argmax(fills.value))
    spread = float(fills.value[high] - fills.value[low])
    both = math.hypot(fills.uncertainty[low], fills.uncertainty[high]) if spread > 0 else 0.0
    return Evidence(
        quantities={
            "k_scene": Found(
                value=float(middle.k.value[0]),
                input=from_half_width(float(middle.k.uncertainty[0])),
                reference=_PRINTED_K,
            ),
            "fill_spread": Found(value=spread, input=from_half_width(both)),
        }
    )


def drag_coefficient(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """k(u) over fills, bores, liquids and pressures."""
    middle, fills = _running(scene, _driving_heads(scene, [0.5])), _over_fills(scene).k.value
    k = float(middle.k.value[0])
    printed, bare = fig_7_readings()
    narrow = _running(bare, _driving_heads(bare, [0.5]))
    bores = [float(_with_bore(scene, factor).k.value[0]) for factor in _BORES]
    liquids = {
        liquid.name: _under_gas(dataclasses.replace(scene, liquid=liquid))
        for liquid in liquids_at_room_temperature()
    }
    runs = liquids.values()
    of_liquids = [float(run.k.value[0]) for run in runs]
    table = CaseTable(
        name="k of the scene's tube with each known liquid, equal fills, the scene's gas pressure",
        columns={
            "liquid": list(liquids),
            "velocity": [float(run.velocity[0]) for run in runs],
            "Reynolds number": [float(run.reynolds[0]) for run in runs],
            "k": of_liquids,
            "half-width": [float(run.k.uncertainty[0]) for run in runs],
            "flow": [str(run.flow_state[0]) for run in runs],
        },
        units={"velocity": "m/s", "Reynolds number": "1", "k": "1", "half-width": "1"},
    )
    differences = _differences(printed, bare)
    # Rows of the table that the text names, by law.
    rows = {"pressure": 2, "empty": 4, "warm": 5, "oil": 6}
    _, *laws = differences.columns.values()
    return Evidence(
        quantities=drag_coefficient_ends(scene).quantities,
        numbers={
            "gas": scene.gas.pressure,
            "velocity": middle.velocity[0],
            "bore": scene.tube.bore,
            "times_50": math.sqrt((PAPER_DRAG_COEFFICIENT + 1) / (k + 1)),
            "printed_bore": printed.tube.bore,
            "k_own": k,
            "bare_bore": bare.tube.bore,
            "bare_k": narrow.k.value[0],
            "bare_velocity": narrow.velocity[0],
            "k_low": np.min(fills),
            "k_high": np.max(fills),
            "bore_low": min(bores),
            "bore_high": max(bores),
            "liquid_low": min(of_liquids),
            "liquid_high": max(of_liquids),
            "bore_for_50": _bore_for(scene, PAPER_DRAG_COEFFICIENT),
            **{
                f"{name}_{law}": float(column[row])
                for law, column in zip(("paper", "calibrated"), laws, strict=True)
                for name, row in rows.items()
            },
        },
        series=(_over_velocity(scene),),
        tables=(table, differences),
    )


def _over_velocity(scene: Scene) -> Series:
    curve = tube_loss(scene, np.geomspace(*_FIGURE_VELOCITIES))
    return figure(
        "k against the velocity, the scene's tube and liquid",
        ("velocity", "m/s", curve.velocity),
        FigureCurve("k(u)", "1", curve.k.value, uncertainty=curve.k.uncertainty),
        FigureCurve("50", "1", np.full(curve.velocity.shape, PAPER_DRAG_COEFFICIENT), style="paper"),
        log=True,
    )


def _over_fills(scene: Scene) -> TubeLoss:
    return _running(scene, _driving_heads(scene, np.linspace(0, 1, 11)))


def _with_bore(scene: Scene, factor: float) -> TubeLoss:
    """Loss with the bore times a factor; bend radii are at least the bore, so that wide tubes can bend."""
    tube, bore = scene.tube, factor * scene.tube.bore
    bends = tuple(dataclasses.replace(bend, radius=max(bend.radius, bore)) for bend in tube.bends)
    return _under_gas(dataclasses.replace(scene, tube=dataclasses.replace(tube, bore=bore, bends=bends)))


def _bore_for(scene: Scene, k: float) -> float:
    """Bore at which the scene's path has a given k; the scene's own where no narrower one has it."""

    def excess(factor: float) -> float:
        return float(_with_bore(scene, factor).k.value[0]) - k

    if excess(1.0) >= 0 or excess(_MIN_BORE_RATIO) <= 0:
        return scene.tube.bore
    return float(brentq(excess, _MIN_BORE_RATIO, 1.0, xtol=1e-6)) * scene.tube.bore


def _differences(scene: Scene, bare: Scene) -> CaseTable:
    """Velocities of both laws over those at equal fills, each on the disc that meets Fig. 7 under it."""
    full, gas = scene.disc.max_fill_ratio, scene.gas.pressure
    rows = {
        "equal fills, 0.7 MPa of gas and water": (scene.liquid, full / 2, gas),
        "1.5 times the gas pressure": (scene.liquid, full / 2, 1.5 * gas),
        "2.5 times the gas pressure": (scene.liquid, full / 2, 2.5 * gas),
        "driven chamber full": (scene.liquid, full, gas),
        "driven chamber nearly empty": (scene.liquid, 0.05 * full, gas),
        "water at 60 degrees Celsius": (liquid_at(name="water", temperature=_WARM_K), full / 2, gas),
        _OIL: (liquid_at(name=_OIL, temperature=_OIL_TABLE_K), full / 2, gas),
    }

    columns: dict[str, Sequence[float | str]] = {"condition": list(rows)}
    for name, law_of, disc in (
        ("by Eq. 19, k = 50", paper_law, scene),
        ("by the calibrated law", flow_law_of, bare),
    ):
        laws = [law_of(dataclasses.replace(disc, liquid=liquid)) for liquid, _, _ in rows.values()]
        velocities = [
            float(law.evaluate(fill_ratio=fill, gas_pressure=pressure).velocity)
            for law, (_, fill, pressure) in zip(laws, rows.values(), strict=True)
        ]
        columns[name] = [velocity / velocities[0] for velocity in velocities]
    return CaseTable(
        name="what differs between the laws once both meet Fig. 7: velocity over that at equal fills",
        columns=columns,
    )
