"""Design within the disc that a scene has: its open keys, and the answer kept for a report."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace
from typing import Any

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.judging.judge import judged_all, plain_settings
from ringbalance.controller.liquid_ring.offers import valves_on_sale
from ringbalance.design.designing import Design
from ringbalance.design.space import OF_SCENE, VALVE, VALVE_KEYS
from ringbalance.design.static import row_reach, static_rows
from ringbalance.design.store import Store, key_of
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import SceneFile
from ringbalance.scene.platform.kept_code import code_root, trusted


def opens_valve(scene: Scene) -> bool:
    """True if no table [design] states valves, so that valves on sale may be tried."""
    return not scene.design.valves and scene.design.valve_file is None


def beside_unchanged(scene: Scene, design: Design) -> Design:
    """The design of the scene before `within_disc`, with the judgement of its own disc and settings."""
    (unchanged,) = judged_all(balancer_of(scene), [{}])
    reach = row_reach(static_rows(scene, [{}], intervals=False)[0])
    return replace(design, given=scene, unchanged=(unchanged, reach))


def within_disc(scene: Scene, *, other_valves: bool = False) -> Scene:
    """Scene whose [design] leaves bore, gas pressure, siphon crest, gas hole and valve open, not the size.

    What its [design] states stays; else the pressure reaches up to the scene's own, the crest lies between
    the inner wall and where it is sure to hold the liquid, a gas hole has up to three times its diameter
    where a crater is limited, and the valve is that of the scene, or one of some on sale where it gives none.
    Args: `other_valves`: True for those on sale beside the scene's own.
    """
    keys, disc, gas = scene.design, scene.disc, scene.gas
    changes: dict[str, Any] = {"design.outer_radius": None, "design.axial_width": None}
    if keys.pressure is None:
        changes["design.pressure"] = gas.pressure
    if opens_valve(scene) and (other_valves or gas.conductance is None):
        valves = [{key: getattr(each, key) for key in ("name", *VALVE_KEYS)} for each in valves_on_sale()]
        if gas.conductance is not None:
            valves.insert(0, {"name": OF_SCENE, **{key: getattr(gas, key) for key in VALVE_KEYS}})
        changes["design.valves"] = [
            {key: value for key, value in valve.items() if value is not None} for valve in valves
        ]
    if not keys.vary:
        vary, highest = [], Holding.of(scene, fill_ratio=disc.max_fill_ratio).largest_hump_radius
        if scene.tube.hump_radius is not None and highest is not None and highest > disc.inner_radius:
            vary.append(f"tube.hump_radius={disc.inner_radius}m:{math.floor(1e4 * highest) / 1e4}m")
        if scene.requirement.crater is not None and disc.gas_hole_diameter is not None:
            vary.append(f"disc.gas_hole_diameter={disc.gas_hole_diameter}m:{3 * disc.gas_hole_diameter}m")
        changes["design.vary"] = vary
    return scene.with_values(changes)


def keep_design(scene: SceneFile, design: Design) -> None:
    """Keep the answer for a scene, where this user may write."""
    judgement, folder = design.judgement, code_root()
    if judgement is None or not trusted(folder):
        return
    answer = {
        "valve": design.space.names(design.point).get(VALVE, ""),
        "changes": plain_settings({**design.point, **judgement.settings}),
        "fraction": judgement.fraction.document(),
        "verdict": judgement.verdict,
        "half_settle_s": judgement.settling_times["p50"],
        "ninety_percent_settle_s": judgement.settling_times["p90"],
    }
    # Without it the next report shows the command.
    with contextlib.suppress(OSError):
        Store(folder=folder / "designs").put(_key(scene), answer)


def kept_design(scene: SceneFile) -> dict[str, Any] | None:
    """Answer that `keep_design` has kept for a scene of these values, SI; None: there is none."""
    folder = code_root() / "designs"
    answer: dict[str, Any] | None = Store(folder=folder).get(_key(scene)) if trusted(folder) else None
    return answer


def _key(scene: SceneFile) -> str:
    return key_of({"in_place": scene.values_sha256})
