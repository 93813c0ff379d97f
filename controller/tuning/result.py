"""What is recommended for a liquid ring's controller, with its document and its rows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from ringbalance.controller.liquid_ring.loop_factor import LoopFactor, Margins
from ringbalance.controller.tuning.recommendation import Contribution
from ringbalance.controller.tuning.search import Search
from ringbalance.controller.tuning.settling import SettlingTimes
from ringbalance.reduced_model.gas_line import LineAnswer, line_document, line_text, line_warning
from ringbalance.reduced_model.terms import ModelUsed, neglected_in_injections
from ringbalance.results.numbers import percent
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import finite
from ringbalance.scene.changes import rechecked
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene


@dataclass(frozen=True, kw_only=True, repr=False)
class Tuning(Result):
    """What is recommended for a scene's controller under a law."""

    scene: Scene
    """With what is recommended."""
    law: str
    gain: float | None
    """Kc, s/m; None for an algorithm without a gain, and where no gain reaches the limit."""
    present: LoopFactor
    """With the scene's own gain."""
    loop: LoopFactor
    """With the recommended one."""
    margins: Margins | None
    contributions: tuple[Contribution, ...]
    first_gas_time: float | None
    """s, of the vector, for the initial vibration."""
    last_gas_time: float | None
    """s, for an amplitude at the limit."""
    smallest_correction: float
    """Change of the vibration by the shortest valve-open time in the fastest chamber, m."""
    dead_times: tuple[float, ...]
    """s, of every chamber; empty where runs do not model the filling of gas."""
    dead_zone: float
    """Largest amplitude at which no valve may open any more, or none transfers liquid, m."""
    change: str
    """Keys and values that are recommended beside the gain; empty: none."""
    search: Search | None
    """What was tried because the runs under the first recommendation do not settle; None: they do."""
    beyond_capacity: float
    """Vibration that remains with the liquid at its best, m."""
    reachable: bool | None
    """Whether valves and gas line can bring the amplitude below the limit; None: the line is not known."""
    gas_line: tuple[LineAnswer, ...]
    """What the gas line can deliver, or both ends of a default range of lines."""
    settling: SettlingTimes | None
    models_used: tuple[ModelUsed, ...]
    status: str

    def to_dict(self) -> dict[str, Any]:
        """In SI; null: there is none, or a quantile is not reached."""
        return _document(self)

    def rows(self) -> Rows:
        """What is recommended, the margins, and the settling times."""
        return _rows(self)

    @property
    def recommended_scene(self) -> AnyScene:
        """The scene with what is recommended, checked, with a hash of its own."""
        return rechecked(self.scene)

    @property
    def succeeded(self) -> bool:
        """Whether 95 % of the runs settle in time, and nothing that is known stands against it."""
        reached = self.settling is not None and self.settling.quantiles["p95"] is not None
        return reached and self.reachable is not False


def _document(tuning: Tuning) -> dict[str, Any]:
    loop, margins, settling, scene = tuning.loop, tuning.margins, tuning.settling, tuning.scene
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": scene.balancer,
        "law": tuning.law,
        "controller": scene.controller.kind,
        "status": tuning.status,
        "gain": tuning.gain,
        "loop_factor": loop.value,
        "loop_factor_limit": loop.limit,
        "present": {"loop_factor": tuning.present.value, "unstable": tuning.present.unstable},
        "vibration_rate_m_per_s": loop.rate,
        "stationary_deviation_m": finite(loop.deviation),
        "margins": None
        if margins is None
        else {name: finite(value) for name, value in asdict(margins).items()}
        | {"left_gain_factor": margins.left_gain_factor, "left_phase": margins.left_phase},
        "uncertainty": [asdict(part) for part in tuning.contributions],
        "first_gas_time_s": tuning.first_gas_time,
        "last_gas_time_s": tuning.last_gas_time,
        "minimum_gas_time_s": scene.controller.minimum_gas_time,
        "smallest_correction_m": tuning.smallest_correction,
        "dead_zone_m": tuning.dead_zone,
        "dead_time_s": list(tuning.dead_times) or None,
        "gas_time_offset_s": list(scene.controller.offsets(scene.disc.chambers)),
        "change": tuning.change,
        "tried": [] if tuning.search is None else [asdict(row) for row in tuning.search.tried],
        "reachable_limit_m": None if tuning.search is None else tuning.search.limit,
        "faster_valve": None if tuning.search is None else tuning.search.valve,
        "shorter_opening_s": None if tuning.search is None else tuning.search.opening,
        "limit_m": scene.controller.limit,
        "beyond_capacity_m": tuning.beyond_capacity,
        "reachable": tuning.reachable,
        "gas_line": line_document(tuning.gas_line),
        "settling_time_s": None if settling is None else settling.quantiles,
        "fraction_settled": None if settling is None else settling.settled.value,
        "fraction_settled_95": None if settling is None else [settling.settled.low, settling.settled.high],
        "fraction_beyond_capacity": None if settling is None else settling.beyond_capacity,
        "fraction_beyond_pressure": None if settling is None else settling.beyond_pressure,
        "fraction_drifted": None if settling is None else settling.drifted,
        "runs": 0 if settling is None else settling.runs,
        "left_out": [],
        "neglected": asdict(neglected_in_injections(tuning.models_used)),
        "models_used": [asdict(used) for used in tuning.models_used],
        **tuning.rows().document(),
    }


def _rows(tuning: Tuning) -> Rows:
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
