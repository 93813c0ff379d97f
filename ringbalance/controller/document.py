"""A finished run as a JSON document for scripts, as a table of its histories, and as text.

Where a scene gives no gas line, runs at both ends of the default range are reported as well.
`conventions` gives the run in the quantities and units of balancing shops and machine operators.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.balance_grades import grade_quantities
from ringbalance.controller.balancer import WATCH_TIME_S
from ringbalance.controller.liquid_ring.drying import drying
from ringbalance.controller.liquid_ring.loop_factor import vibration_left
from ringbalance.controller.simulation import GasUse, Simulation, noise_floor
from ringbalance.physics import balancing
from ringbalance.physics.evaporation import carried_off
from ringbalance.reduced_model.gas_line import line_document, line_ends, line_text
from ringbalance.reduced_model.injection.dynamics import Event, gives_forces
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.residual_liquid import Holding
from ringbalance.reduced_model.terms import FILLING, HELD, INERTIA, LAG, neglected_in_injections
from ringbalance.results.numbers import format_given, plain
from ringbalance.results.result import Rows, Table, models_table
from ringbalance.results.rows import Finding, Quantity
from ringbalance.scene.arrays import FloatArray, finite
from ringbalance.scene.keys.derivations import permissible_unbalance


def simulation_document(simulation: Simulation) -> dict[str, Any]:
    """A run as a JSON document in SI.

    `time_s`, `amplitude_m`, `phase_rad` and each list of `fill_ratio` have one length and hold the true
    state, `reading_amplitude_m` what an exact sensor with runout shows of it; the samples of the sensor are
    under `samples`, null where one was dropped or not a number.
    """
    scene, gas = simulation.scene, simulation.gas
    measurements = [sample.measurement for sample in simulation.samples]
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": simulation.balancer,
        "controller": simulation.controller,
        "law": simulation.law,
        "settled": simulation.settled,
        "settling_time_s": simulation.settling_time,
        "verdict": simulation.verdict.value,
        "outcome": simulation.outcome.value,
        "status": simulation.status,
        "limit_m": simulation.limit,
        "hold_time_s": scene.controller.hold_time,
        "further_time_s": WATCH_TIME_S,
        "loop_factor": simulation.loop.value,
        "loop_factor_limit": simulation.loop.limit,
        "vibration_rate_m_per_s": simulation.loop.rate,
        "stationary_deviation_m": finite(simulation.loop.deviation),
        "vibration_left_m": vibration_left(scene, simulation.loop),
        "time_s": simulation.time.tolist(),
        "amplitude_m": simulation.amplitude.tolist(),
        "phase_rad": simulation.phase.tolist(),
        **({"reading_amplitude_m": simulation.reading.tolist()} if _has_runout(simulation) else {}),
        "injections": [
            {
                "time_s": each.time,
                "chamber": each.chamber,
                "duration_s": each.duration,
                "regime": each.regime_start.label,
                "regime_end": each.regime_end.label,
                "event": each.event.value,
                "fill_before": each.fill_before,
                "fill_after": each.fill_after,
                "energy_J": each.energy,
                "run_dry_s": each.run_dry,
            }
            for each in simulation.injections
        ],
        "fill_ratio": {letter: fill.tolist() for letter, fill in simulation.fill_ratio.items()},
        "overshoots": simulation.overshoots,
        "misadjustments": simulation.misadjustments,
        "injections_shortened": simulation.shortened,
        "energy_J": simulation.energy,
        "gas": {
            "fillings": gas.fillings,
            "normal_litres": gas.normal_volume * 1e3,
            "compression_energy_J": gas.energy,
            "injections_run_dry": gas.run_dry,
            "residual_fill_ratio": gas.residual_fill_ratio,
            "injections_below_residual_fill": gas.below_residual,
            "passed_through_normal_litres": gas.passed_through * 1e3,
            "leaked_normal_litres": gas.leaked * 1e3,
            "warning": "" if gas.finding is None else gas.finding.text,
        },
        "gas_line": line_document(simulation.gas_line),
        "noise_floor_m": noise_floor(scene),
        "samples": {
            "time_s": [sample.time for sample in simulation.samples],
            "amplitude_m": [None if each is None else finite(each.amplitude) for each in measurements],
            "phase_rad": [None if each is None else finite(each.phase) for each in measurements],
            "resting": [sample.command.resting for sample in simulation.samples],
        },
        "terms_modelled": list(simulation.terms_modelled),
        "tolerance": scene.tolerance,
        "models_used": [asdict(used) for used in simulation.models_used],
        "neglected": asdict(neglected_in_injections(simulation.models_used)),
        "conventions": [each.document() for each in conventions(simulation)],
        "model_status": {"code": str(simulation.model_status.code), "text": simulation.model_status.text},
        **simulation.rows().document(),
    }


def simulation_history(simulation: Simulation) -> dict[str, Sequence[Any]]:
    """Histories of a run by column name; None at instants without a measurement."""
    time = simulation.time
    shown = {sample.time: sample.measurement for sample in simulation.samples}
    seen = [shown.get(instant) for instant in time.tolist()]
    columns: dict[str, Sequence[Any]] = {
        "time_s": time.tolist(),
        "amplitude_m": simulation.amplitude.tolist(),
        "phase_rad": simulation.phase.tolist(),
        **({"reading_amplitude_m": simulation.reading.tolist()} if _has_runout(simulation) else {}),
        "measured_amplitude_m": [None if m is None else finite(m.amplitude) for m in seen],
        "measured_phase_rad": [None if m is None else finite(m.phase) for m in seen],
    }
    for letter, fill in simulation.fill_ratio.items():
        gas = np.zeros(time.size, dtype=np.int64)
        for injection in simulation.injections:
            if injection.chamber == letter:
                end = injection.time + injection.duration
                gas[(time >= injection.time) & (time <= end)] = 1
        columns |= {f"fill_ratio_{letter}": fill.tolist(), f"valve_open_{letter}": gas.tolist()}
    return columns


def _has_runout(simulation: Simulation) -> bool:
    """True if a reading without noise is not the rotor's vibration."""
    return simulation.scene.sensor.runout_amplitude is not None


_BARS: Final = "▁▂▃▄▅▆▇█"
_SPARK_WIDTH: Final = 32
_MOST_INJECTIONS: Final = 40
_DECADES: Final = 3.0
"""Depth of the sparkline below the largest amplitude."""


def simulation_rows(simulation: Simulation) -> Rows:
    """Quantities, findings, injections and terms of a run."""
    scene, gas, model = simulation.scene, simulation.gas.finding, simulation.model_status
    injections = []
    for each in simulation.injections[:_MOST_INJECTIONS]:
        regimes = " to ".join(dict.fromkeys((each.regime_start.label, each.regime_end.label)))
        event = "" if each.event in {Event.NONE, Event.BLOCKED} else f" ({each.event.value})"
        fills = (f"{each.fill_before:.5f}", f"{each.fill_after:.5f}")
        injections.append((f"{each.time:.3f}", each.chamber, f"{each.duration:.4f}", *fills, regimes + event))
    more = len(simulation.injections) - _MOST_INJECTIONS

    # The line of bars ends shortly after the last valve has closed.
    closed = [i.time + i.duration for i in simulation.injections]
    end = min(float(simulation.time[-1]), 1.2 * max(closed, default=math.inf))
    return Rows(
        title=f"Run of {scene.name} ({scene.source}), {simulation.law} law, {simulation.controller}",
        quantities=_quantities(simulation),
        findings=(
            *simulation.findings,
            *(() if gas is None else (gas,)),
            *(() if model.ok else (Finding(code="out_of_range", values={"text": model.text}),)),
        ),
        facts=(
            ("flow law", simulation.law),
            ("gas line", line_text(simulation.gas_line)),
            ("neglected", neglected_in_injections(simulation.models_used).text),
            ("amplitude (log)", amplitude_line(simulation.time, simulation.amplitude, end=end)),
        ),
        tables=(
            Table(
                caption="Injections",
                heads=("time, s", "chamber", "gas, s", "fill before", "fill after", "regime"),
                rows=injections,
                note=f"and {more} more: see --json" if more > 0 else "",
            ),
            Table(
                caption="In the units of the shop",
                heads=("quantity", "value"),
                rows=[(each.name, plain(each.text)) for each in conventions(simulation)],
            ),
            models_table(simulation.models_used, tolerance=scene.tolerance),
        ),
    )


def _quantities(simulation: Simulation) -> tuple[Quantity, ...]:
    loop, gas, injections = simulation.loop, simulation.gas, simulation.injections
    fills = simulation.fill_ratio.items()
    rows: list[tuple[str, str, str, float | None]] = [
        ("settling_time", "settling time", "s", simulation.settling_time),
        ("initial_amplitude", "amplitude before", "m", float(simulation.amplitude[0])),
        ("final_amplitude", "amplitude at the end", "m", float(simulation.amplitude[-1])),
        ("limit", "limit", "m", simulation.limit),
        ("hold_time", "hold time", "s", simulation.scene.controller.hold_time),
        ("loop_factor", "loop factor", "1", loop.value),
        ("loop_factor_limit", "loop factor, at most", "1", loop.limit),
        ("stationary_deviation", "standard deviation that noise leaves", "m", finite(loop.deviation)),
        ("valve_open_time", "valve-open time", "s", math.fsum(i.duration for i in injections)),
        ("injections", "injections", "1", len(injections)),
        ("energy", "work on the liquid", "J", simulation.energy),
        ("gas_volume", "gas, normal volume", "m^3", gas.normal_volume),
        ("compression_energy", "compression of the gas", "J", gas.energy),
        ("overshoots", "overshoots", "1", simulation.overshoots),
        ("misadjustments", "misadjustments", "1", simulation.misadjustments),
        *((f"fill_ratio_{at}", f"fill ratio of {at}", "1", float(fill[-1])) for at, fill in fills),
    ]
    if _has_runout(simulation):
        reading = float(simulation.reading[-1])
        rows.insert(3, ("final_reading", "reading at the end, without noise", "m", reading))
    origins = {"limit": "given", "hold_time": "given"}
    return tuple(
        Quantity(key=key, name=name, unit=unit, value=value, origin=origins.get(key, "simulated"))
        for key, name, unit, value in rows
    )


def amplitude_line(time: FloatArray, amplitude: FloatArray, *, end: float) -> str:
    """Amplitude up to `end`, s, as a line of bars, logarithmic; linear between instants."""
    return f"{_sparkline(np.interp(np.linspace(0.0, end, _SPARK_WIDTH), time, amplitude))} to {end:.3g} s"


def _sparkline(values: FloatArray) -> str:
    """Draw values as a line of bars, logarithmic over three decades below the largest."""
    top = float(np.max(values, initial=0.0))
    if top == 0:
        return _BARS[0] * values.size
    depth = np.log10(np.maximum(values / top, 10.0**-_DECADES)) / _DECADES + 1
    return "".join(_BARS[round(height * (len(_BARS) - 1))] for height in depth)


def line_runs(nominal: Simulation) -> dict[str, Simulation]:
    """Runs of the same scene and law with a "slow" and a "fast" gas line, all terms of an injection modelled;
    empty if the scene gives its gas line, the law no forces, or algorithm or sensor are the caller's own."""
    scene, flow = nominal.scene, nominal.model.flow
    ends = line_ends(scene)
    if len(ends) == 1 or not gives_forces(flow) or not nominal.as_scene:
        return {}
    # The paper's law has no mass in the tube and no crest.
    terms = (FILLING, LAG) if isinstance(flow, PaperLaw) else (INERTIA, HELD, FILLING, LAG)
    runs = {}
    for end in ends:
        conductance, ratio = end.line.conductance, end.line.critical_ratio
        gas = replace(scene.gas, conductance=conductance, critical_ratio=ratio, valve_lag=end.valve_lag)
        runs[end.name] = nominal.again(replace(scene, gas=gas), modelled=terms)
    return runs


def line_runs_table(runs: Mapping[str, Simulation]) -> Table:
    """Table of the results of runs with both gas lines."""
    return Table(
        caption="The scene gives no gas line; with both ends of its default range",
        heads=("line", "run", "settling time", "amplitude at the end"),
        rows=[
            (
                end,
                run.verdict.value,
                format_given(run.settling_time, "s", digits=3),
                format_given(float(run.amplitude[-1]), "m", digits=3),
            )
            for end, run in runs.items()
        ],
    )


def command_document(nominal: Simulation) -> dict[str, Any]:
    """Document of a run as `ringbalance simulate --json` prints it."""
    runs = [
        {
            "end": end,
            "conductance_m3_per_s_Pa": run.scene.gas.conductance,
            "valve_lag_s": run.scene.gas.valve_lag,
            "settled": run.settled,
            "settling_time_s": run.settling_time,
            "verdict": run.verdict.value,
            "outcome": run.outcome.value,
            "final_amplitude_m": float(run.amplitude[-1]),
            "overshoots": run.overshoots,
            "injections": len(run.injections),
            "status": run.status,
        }
        for end, run in line_runs(nominal).items()
    ]
    return simulation_document(nominal) | {"gas_line_runs": runs}


_HOUR_S: Final = 3600.0


CONSUMPTION: Final = ("gas_per_hour", "liquid_per_hour", "liquid_part_per_hour", "holding_time")
"""Keys of `conventions` that say what holding the balance takes."""


def conventions(run: Simulation) -> Iterator[Quantity]:
    """Unbalances and vibrations of the run as ISO 21940 and ISO 20816 name them, the loop's peak sensitivity,
    gas used, and lowest speed at which the correction lasts without gas.
    """
    scene, before, after = run.scene, float(run.amplitude[0]), float(run.amplitude[-1])
    rotor, grade = scene.rotor, scene.requirement.grade
    influence = rotor.influence_coefficient
    yield Quantity.simulated("residual_unbalance", "residual unbalance at the end", after / influence, "kg m")
    if grade is not None and rotor.mass is not None:
        permissible = permissible_unbalance(grade=grade, mass=rotor.mass, speed=rotor.speed)
        name = "permissible residual unbalance (ISO 21940-11)"
        yield Quantity.simulated("permissible_unbalance", name, permissible, "kg m")
    yield from grade_quantities(
        mass=rotor.mass,
        speed=rotor.speed,
        residual=after / influence,
        limit=run.limit / influence,
        reached_by="at the end",
    )
    # The first correction ends when the next one begins: liquid flows until then.
    starts = sorted({each.time for each in run.injections if each.moved})
    ends = [float(np.interp(each, run.time, run.amplitude)) for each in (*starts, math.inf)[:2]]
    for key, name, two in (
        ("unbalance_reduction_ratio", "unbalance reduction ratio (ISO 21940-21), first correction", ends),
        ("unbalance_reduction", "reduction of the unbalance over the whole run", [before, after]),
    ):
        ratio = None
        if len(two) == 2 and two[0] > 0:
            ratio = balancing.unbalance_reduction_ratio(before=two[0], after=two[1])
        yield Quantity.simulated(key, name, ratio, "1")
    vibration = vibration_left(scene, run.loop)
    left = None if vibration is None else vibration / influence
    name = "unbalance that noise leaves at most with this run's settings"
    yield Quantity.simulated("unbalance_left", name, left, "kg m")
    for key, when, amplitude in (("initial", "before", before), ("final", "at the end", after)):
        velocity = balancing.rms_velocity(amplitude=amplitude, speed=rotor.speed)
        yield Quantity.simulated(f"{key}_peak_to_peak", f"vibration {when}, peak to peak", 2 * amplitude, "m")
        yield Quantity.simulated(f"{key}_velocity", f"vibration {when}, velocity, rms", velocity, "m/s")
    margins = run.loop.margins if run.loop.fixed else None
    if margins is not None and margins.stable:
        peak = margins.sensitivity_peak
        name = f"peak sensitivity of the proportional part (zone {balancing.zone(peak)} of ISO 14839-3)"
        yield Quantity.simulated("peak_sensitivity", name, peak, "1")
    yield from _consumption_rows(run)
    yield from _lasting_rows(run)


def _consumption_rows(run: Simulation) -> Iterator[Quantity]:
    """Time of the first correction, and the gas and the liquid that corrections and holding take."""
    first = min((each.time + each.duration for each in run.injections if each.moved), default=None)
    corrections = len({each.time for each in run.injections})
    per_correction = run.gas.normal_volume / corrections if corrections else None
    hourly, used, since, end = None, None, run.settling_time, float(run.time[-1])
    span = 0.0 if since is None else end - since
    if since is not None and end > since:
        later = [each for each in run.injections if each.time > since]
        used = GasUse.of(scene=run.scene, model=run.model, injections=later, time=span)
        hourly = used.normal_volume / span * _HOUR_S
    yield Quantity.simulated("first_correction", "first correction made after", first, "s")
    yield Quantity.simulated("gas_per_correction", "gas per correction, normal volume", per_correction, "m^3")
    yield Quantity.simulated("gas_per_hour", "gas per hour to hold it, normal volume", hourly, "m^3")
    each, loss = carried_off(run.scene), drying(run, used, span=span)
    code = "ok" if each is not None else "not_known"
    taken = None if each is None or not corrections else each * (run.gas.normal_volume - run.gas.leaked)
    per_correction = None if taken is None else taken / corrections
    yield Quantity.simulated(
        "liquid_per_correction", "liquid that gas takes per correction", per_correction, "kg", code
    )
    yield Quantity.simulated(
        "liquid_per_hour", "liquid that gas takes per hour to hold it, at most", loss.per_hour, "kg", code
    )
    yield Quantity.simulated(
        "liquid_part_per_hour", "part of all liquid, per hour, at most", loss.part_per_hour, "1", code
    )
    name = "holding until the lost liquid is missing for the initial unbalance"
    yield Quantity.simulated("holding_time", name, loss.holding_time, "s", code)


def _lasting_rows(run: Simulation) -> Iterator[Quantity]:
    """Speeds down to which a correction lasts without gas, by hydrostatics.

    Down to the lowest speeds the fullest chamber keeps its liquid with the gas off: to the first at any
    pressure of a cavity over the crest, to the second at the pressure that runs assume.  Below them it runs
    back as the speed falls, until at two further speeds the column holds full at equal fills.
    """
    held = Holding.of(run.scene, fill_ratio=max(float(each[-1]) for each in run.fill_ratio.values()))
    status = "ok" if held.finding is None else held.finding.code
    for key, how_sure, speed in (
        ("lasting_speed", "sure", held.sure_speed),
        ("likely_lasting_speed", "perhaps", held.likely_speed),
    ):
        name = f"correction lasts without gas, {how_sure} down to"
        yield Quantity.simulated(key, name, speed, "rad/s", "ok" if speed is not None else status)
    level = Holding.of(run.scene, fill_ratio=run.scene.disc.initial_fill)
    for key, how_sure, lasting, speed in (
        ("levelled_speed", "perhaps", held.sure_speed, level.sure_speed),
        ("likely_levelled_speed", "as runs assume", held.likely_speed, level.likely_speed),
    ):
        name = f"slow run-down levels opposite chambers, {how_sure} at"
        yield Quantity.simulated(
            key, name, None if lasting is None else speed, "rad/s", "ok" if lasting is not None else status
        )
