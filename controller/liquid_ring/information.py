"""What is known of a liquid ring's loop under its settings without a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from ringbalance.controller.algorithms.by_name import controller_of
from ringbalance.controller.judging.tuning import Information
from ringbalance.controller.liquid_ring.loop_factor import LoopFactor, Margins, loop_factor, loop_margins
from ringbalance.controller.terms import run_models
from ringbalance.reduced_model.gas_line import line_answers, line_document, line_text
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.terms import neglected_in_injections
from ringbalance.results.rows import Quantity
from ringbalance.scene.arrays import finite
from ringbalance.scene.models import Scene


def loop_information(scene: Scene, model: BalancerModel) -> Information:
    """Loop factor and margins of the linear loop about the balanced state, and what the gas line does."""
    loop, settings = loop_factor(scene, model, controller_of(scene, model)), scene.controller
    used, lines, margins = (
        run_models(scene=scene, model=model),
        line_answers(scene, model),
        _margins(scene, loop),
    )
    neglected = neglected_in_injections(used)
    document: dict[str, Any] = {
        "law": model.name,
        "controller": settings.kind,
        "gain": settings.proportional if settings.kind == "target_vector" else None,
        "loop_factor": loop.value,
        "loop_factor_limit": loop.limit,
        "vibration_rate_m_per_s": loop.rate,
        "stationary_deviation_m": finite(loop.deviation),
        "margins": None
        if margins is None
        else {name: finite(value) for name, value in asdict(margins).items()},
        "gas_time_offset_s": list(settings.offsets(scene.disc.chambers)),
        "limit_m": settings.limit,
        "gas_line": line_document(lines),
        "left_out": [],
        "neglected": asdict(neglected),
        "models_used": [asdict(each) for each in used],
    }
    return Information(
        quantities=tuple(_quantities(loop, margins)),
        facts=[
            ("flow law", model.name),
            ("algorithm", settings.kind.replace("_", " ")),
            ("gas line", line_text(lines)),
            ("neglected", neglected.text),
        ],
        document=document,
    )


def _margins(scene: Scene, loop: LoopFactor) -> Margins | None:
    """Of a loop that liquid flows in; the law-based algorithm comes to a loop factor of one."""
    settings = scene.controller
    if loop.rate == 0.0 or settings.kind == "trial":
        return None
    fixed = settings.kind == "target_vector"
    return loop_margins(
        loop_factor=loop.value if fixed and loop.value else 1.0,
        integral=settings.period / (settings.integral_time or math.inf) if fixed else 0.0,
        derivative=settings.derivative_time / settings.period if fixed else 0.0,
    )


def _quantities(loop: LoopFactor, margins: Margins | None) -> Iterator[Quantity]:
    rows: list[tuple[str, str, str, float | None]] = [
        ("loop_factor", "loop factor", "1", loop.value),
        ("loop_factor_limit", "loop factor from which a residual grows", "1", loop.limit),
        ("stationary_deviation", "standard deviation that noise leaves", "m", finite(loop.deviation)),
    ]
    if margins is not None:
        rows += [
            ("gain_margin", "gain margin, factor", "1", finite(margins.gain_factor)),
            ("phase_margin", "phase margin", "rad", margins.phase),
            ("disk_gain_margin", "disk margin, factor", "1", finite(margins.disk_gain_factor)),
            ("disk_phase_margin", "disk margin, phase", "rad", margins.disk_phase),
        ]
    for key, name, unit, value in rows:
        if value is not None:
            yield Quantity(key=key, name=name, unit=unit, value=value, digits=3)
