"""A tuning of a liquid ring as rows."""

from __future__ import annotations

from collections.abc import Iterator

from ringbalance.controller.tuning.result import Tuning
from ringbalance.reduced_model.gas_line import line_text, line_warning
from ringbalance.reduced_model.terms import neglected_in_injections
from ringbalance.results.numbers import percent
from ringbalance.results.result import Rows, Table
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import finite


def tuning_rows(tuning: Tuning) -> Rows:
    """What is recommended, the margins, and the settling times."""
    scene = tuning.scene
    facts = [("flow law", tuning.law), ("algorithm", scene.controller.kind.replace("_", " "))]
    if tuning.change:
        facts.append(("recommended beside the gain", tuning.change))
    facts.append(("gas line", line_text(tuning.gas_line)))
    facts.append(("neglected", neglected_in_injections(tuning.models_used).text))
    parts = [(part.name, percent(part.uncertainty), part.source) for part in tuning.contributions]
    tried = tuning.search.tried if tuning.search else ()
    return Rows(
        title=f"Tuning of {scene.name} ({scene.source}), {tuning.law} law, {scene.controller.kind}",
        quantities=tuple(_quantities(tuning)),
        findings=tuple(_findings(tuning)),
        facts=facts,
        tables=(
            Table(
                caption="Tried",
                heads=("change", "settled"),
                rows=[(row.change, f"{round(row.settled * row.runs)} of {row.runs} runs") for row in tried],
            ),
            Table(
                caption="Uncertainty of the loop factor (95 %)",
                heads=("part", "relative", "from"),
                rows=parts,
            ),
        ),
    )


def _findings(tuning: Tuning) -> Iterator[Finding]:
    change = {} if tuning.gain is None else {"controller.proportional": tuning.gain}
    code = "tuned" if tuning.succeeded else "not_tuned"
    yield Finding(code=code, values={"text": tuning.status}, change=change)
    # Runs that settle with the scene's own line have shown what its smallest correction left open.
    if (warning := line_warning(tuning.gas_line)) and not tuning.reachable:
        yield Finding(code="gas_line", values={"text": warning})


def _quantities(tuning: Tuning) -> Iterator[Quantity]:
    settings, loop, margins = tuning.scene.controller, tuning.loop, tuning.margins
    dead = tuning.dead_times
    rows: list[tuple[str, str, str, float | None]] = [
        ("gain", "recommended controller.proportional", "s/m", tuning.gain),
        ("loop_factor", "loop factor", "1", loop.value),
        ("loop_factor_limit", "loop factor, at most", "1", loop.limit),
        ("present_loop_factor", "loop factor of the scene", "1", tuning.present.value),
        ("stationary_deviation", "standard deviation that noise leaves", "m", finite(loop.deviation)),
        ("limit", "limit", "m", settings.limit),
        ("first_gas_time", "valve-open time at first", "s", tuning.first_gas_time),
        ("last_gas_time", "valve-open time at the limit", "s", tuning.last_gas_time),
        ("minimum_gas_time", "shortest valve-open time", "s", settings.minimum_gas_time),
        ("dead_time_min", "dead time of the valves, least", "s", min(dead, default=None)),
        ("dead_time_max", "dead time of the valves, most", "s", max(dead, default=None)),
        ("dead_zone", "no injection moves liquid up to", "m", tuning.dead_zone),
        ("smallest_correction", "smallest correction, ideal valve", "m", tuning.smallest_correction),
    ]
    if margins is not None:
        rows += [
            ("gain_margin", "gain margin, factor", "1", finite(margins.gain_factor)),
            ("phase_margin", "phase margin", "rad", margins.phase),
            ("disk_gain_margin", "disk margin, factor", "1", finite(margins.disk_gain_factor)),
            ("disk_phase_margin", "disk margin, phase", "rad", margins.disk_phase),
            ("left_gain_margin", "gain margin left, factor", "1", finite(margins.left_gain_factor)),
            ("left_phase_margin", "phase margin left", "rad", margins.left_phase),
        ]
    given = {"limit", "minimum_gas_time"}
    for key, name, unit, value in rows:
        if value is not None:
            origin = "given" if key in given else "computed"
            yield Quantity(key=key, name=name, unit=unit, value=value, origin=origin, digits=3)
    if tuning.settling is not None:
        yield from tuning.settling.quantities()
