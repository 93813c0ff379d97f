"""The liquid-ring paper's Figs. 4, 6, 7 and 8, drawn again on its own disc with one set of constants."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import replace
from itertools import pairwise
from typing import Any, Final

import numpy as np

from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Simulation
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.law.paper_law import PaperMoment, paper_model
from ringbalance.reports.figure import (
    AMPLITUDE,
    FOUND,
    INK,
    PAPER,
    THIRD,
    TIME,
    Drawing,
    Paint,
    amplitudes,
    curve,
    draw,
    line,
    note,
    upright,
)
from ringbalance.reports.section import Record, Section, Work
from ringbalance.results.numbers import given
from ringbalance.scene.models import Scene
from ringbalance.verification import papers
from ringbalance.verification.loops import AMPLITUDES, GAINS, PHASES, calibration_of, loop_scene, run_loop
from ringbalance.verification.runner import paper_scene

_FLOOR: Final = 5e-9
"""m: smaller amplitudes are drawn here."""
_LINES: Final = {
    "paper_m_s": (PAPER, (0, (5, 2)), "Eq. 19, as Fig. 4 has it"),
    "levels_m_s": (FOUND, "-", "k = 50, levels by finite elements"),
    "calibrated_m_s": (THIRD, "-", "calibrated law"),
}
_FILLS: Final = 41
_SEARCH: Final = tuple((np.arange(4, 41) * 5e3).tolist())
"""Kp among which the onset of overshoot is looked for, s/m."""


def _collect(work: Work) -> Record:
    """Velocities of Fig. 4 and the runs of Figs. 6 to 8, all under the paper's law on the paper's disc."""
    scene = paper_scene()
    own = work.scene.values_sha256 == scene.values_sha256
    calibration = work.calibration if own else calibration_of(scene)
    model = paper_model(scene)
    gains = [_run(run_loop(_alone(scene, gain)), gain) for gain in GAINS]
    amplitudes = [_run(run_loop(loop_scene(scene, kind="target_vector", amplitude=a)), a) for a in AMPLITUDES]
    return {
        "constants": _constants(scene, model),
        "velocity": _velocities(scene, calibration),
        "trial": [_run(run_loop(loop_scene(scene, kind="trial", phase=phase)), phase) for phase in PHASES],
        "gains": gains,
        "amplitudes": amplitudes,
        "results": _results(gains, amplitudes),
        "limit_m": scene.controller.limit,
        "reading": _reading(scene, model),
    }


def _alone(scene: Scene, gain: float) -> Scene:
    """With the proportional part alone."""
    return loop_scene(scene, kind="target_vector", proportional=gain, integral_time=None)


def _rate(scene: Scene, model: BalancerModel) -> float:
    """Fall of the vibration per second of gas at equal fills under the paper's law, m/s."""
    middle = scene.disc.max_fill_ratio / 2
    flow = model.flow.evaluate(fill_ratio=middle, gas_pressure=scene.gas.pressure)
    mass_flow = scene.liquid.density * model.tube_area * float(flow.velocity)
    return scene.rotor.influence_coefficient * paper.PAPER_LAMBDA * mass_flow


def _constants(scene: Scene, model: BalancerModel) -> Record:
    control, rotor = scene.controller, scene.rotor
    return {
        "rate_m_per_s": _rate(scene, model),
        "bore_m": scene.tube.bore,
        "influence_coefficient": rotor.influence_coefficient,
        "period_s": control.period,
        "lag_angle_rad": rotor.lag_angle,
        "first_trial_s": control.first_trial,
        "long_step_s": control.long_step,
        "short_step_s": control.short_step,
        "fine_below_m": control.fine_below,
        "proportional_s_per_m": control.proportional,
        "integral_time_s": control.integral_time,
        "derivative_time_s": control.derivative_time,
        "gas_pressure_Pa": scene.gas.pressure,
        "drag_coefficient": paper.PAPER_DRAG_COEFFICIENT,
        "lambda_m": paper.PAPER_LAMBDA,
    }


def _velocities(scene: Scene, calibration: Calibration) -> list[Record]:
    """Eq. 19, the same k with the finite elements' levels, and the calibrated law, at both pressures."""
    law, fill = calibration.flow_law, np.linspace(0.0, scene.disc.max_fill_ratio, _FILLS)
    rise = law.hydrostatic_pressure(fill) - law.hydrostatic_pressure(scene.disc.max_fill_ratio - fill)
    found = []
    printed = (papers.DEPARTURE_LOW, papers.DEPARTURE_HIGH)
    pressures = (papers.LOW_PRESSURE, papers.HIGH_PRESSURE)
    for pressure, departure in zip(pressures, printed, strict=True):
        eq_19 = calibration.paper_law.evaluate(fill_ratio=fill, gas_pressure=pressure).velocity
        levels = paper.velocity_from_pressures(
            density=law.density,
            drag_coefficient=paper.PAPER_DRAG_COEFFICIENT,
            pressure_difference=pressure + rise,
        )
        flow = law.evaluate(fill_ratio=fill, gas_pressure=pressure, primed=True)
        found.append(
            {
                "gas_pressure_Pa": pressure,
                "fill_ratio": fill.tolist(),
                "paper_m_s": eq_19.tolist(),
                "levels_m_s": levels.tolist(),
                "calibrated_m_s": flow.velocity.tolist(),
                "calibrated_uncertainty": flow.uncertainty.tolist(),
                "departure_printed": departure.value,
                "departure_paper": 1 - float(eq_19[0] / eq_19[-1]),
                "departure_levels": 1 - float(levels[0] / levels[-1]),
                "departure_calibrated": 1 - float(flow.velocity[0] / flow.velocity[-1]),
            }
        )
    return found


def _run(run: Simulation, of: float) -> Record:
    seen = [sample for sample in run.samples if sample.measurement is not None]
    measured = [sample.measurement for sample in seen if sample.measurement is not None]
    return {
        "of": of,
        "time_s": [sample.time for sample in seen],
        "amplitude_m": [m.amplitude for m in measured],
        "phase_rad": [math.remainder(m.phase, 2 * math.pi) for m in measured],
        "settled": run.settled,
        "settling_time_s": run.settling_time,
        "overshoots": run.overshoots,
        "misadjustments": run.misadjustments,
    }


def _reading(scene: Scene, model: BalancerModel) -> Record:
    """Lambda per transferred mass, which the loop uses, against Eqs. 21 and 22 taken literally."""
    literal = replace(model, moment=_literal_moment(model))

    def onset(balancer: BalancerModel) -> float | None:
        # A larger gain never overshoots less.
        first = bisect_left(
            _SEARCH, True, key=lambda gain: simulate(_alone(scene, gain), balancer).overshoots > 0
        )
        return _SEARCH[first] if first < len(_SEARCH) else None

    full = loop_scene(scene, kind="target_vector")
    mass = paper.correction_mass(
        disc=scene.disc, density=scene.liquid.density, fill_ratio=scene.disc.max_fill_ratio
    )
    return {
        "chamber_moment_eq_7_kg_m": papers.CHAMBER_MOMENT.value,
        "chamber_moment_literal_kg_m": paper.PAPER_LAMBDA * float(mass),
        "chamber_moment_transferred_kg_m": paper.PAPER_LAMBDA * float(mass) / 2,
        "onset_transferred_s_per_m": onset(model),
        "onset_literal_s_per_m": onset(literal),
        "figure_8": {
            name: _run(simulate(full, balancer), AMPLITUDES[-1])
            for name, balancer in (("transferred", model), ("literal", literal))
        },
    }


def _literal_moment(model: BalancerModel) -> PaperMoment:
    """Eqs. 21 and 22 as printed: lambda times the difference of the two chambers' masses.

    Args: `model`: the paper's.
    Raises: ValueError: a model whose moment is not the paper's.
    Source: Eqs. 21 and 22 of the liquid-ring paper.
    """
    moment = model.moment
    if not isinstance(moment, PaperMoment):
        raise ValueError("only the paper's model has one lambda")
    return replace(moment, moment_per_transferred_mass=2 * moment.moment_per_transferred_mass)


def _view(found: Record, _evidence: Record) -> Record:
    limit, gains = found["limit_m"], found["gains"]
    names = [f"Kp = {run['of'] * 1e-6:.2f}" for run in gains]
    phases = [f"{math.degrees(run['of']):.0f}°" for run in found["trial"]]
    bound = upright(5.0, "the paper’s bound, 5 s", color=INK, linewidth=0.8, linestyle=(0, (5, 2)))
    end = max(5.4, *(run["time_s"][-1] for run in found["amplitudes"]))
    starts = [given(run["of"], "m") for run in found["amplitudes"]]
    return {
        "levels": _velocity_figure("paper-figure-4", found["velocity"], "levels_m_s"),
        "law": _velocity_figure("paper-figure-4-law", found["velocity"], "calibrated_m_s"),
        "trial": _amplitudes("paper-figure-6", found["trial"], phases, limit, columns=5, wide=True),
        "gains": _amplitudes("paper-figure-7", gains, names, limit, columns=3, height=3.5),
        "phase": _phases(gains, names),
        "amplitudes": _amplitudes(
            "paper-figure-8", found["amplitudes"], starts, limit, bound, columns=4, wide=True, xlim=(0, end)
        ),
    }


def _velocity_figure(name: str, velocity: list[Record], other: str) -> Drawing:
    """Velocity over the fill at both gas pressures: Eq. 19, and beside it another reading."""
    paints: list[Paint] = []
    for index, each in enumerate(velocity):
        fill, middle = each["fill_ratio"], len(each["fill_ratio"]) // 2
        for key in ("paper_m_s", other):
            colour, dashes, label = _LINES[key]
            width = each["calibrated_uncertainty"] if key == "calibrated_m_s" else None
            look = {"color": colour, "linestyle": dashes}
            paints.append(curve(fill, each[key], None if index else label, band=width, **look))
        place = (fill[middle], each[other][middle])
        paints.append(note(given(each["gas_pressure_Pa"], "Pa"), place, (0, 7), ha="center"))
    return draw(
        name,
        *paints,
        x=("fill ratio of the driven chamber", "1"),
        y=("velocity in the tube", "m/s"),
        xlim=(0, velocity[0]["fill_ratio"][-1]),
        ylim=(0, None),
        height=3.4,
    )


def _look(index: int, label: str) -> dict[str, Any]:
    return {"label": label, "linewidth": 1.2, **line(index, size=2.6)}


def _amplitudes(
    name: str, runs: list[Record], labels: list[str], limit: float, *paints: Paint, **frame: Any
) -> Drawing:
    """Amplitude at each sample of several runs; limit in m."""
    curves = [
        (run["time_s"], np.maximum(run["amplitude_m"], _FLOOR), _look(index, label))
        for index, (run, label) in enumerate(zip(runs, labels, strict=True))
    ]
    return draw(name, amplitudes(curves, limit), *paints, x=TIME, y=AMPLITUDE, **{"height": 3.4, **frame})


def _phases(runs: list[Record], labels: list[str]) -> Drawing:
    return draw(
        "paper-figure-7-phase",
        *(
            curve(run["time_s"], np.degrees(run["phase_rad"]), **_look(index, label))
            for index, (run, label) in enumerate(zip(runs, labels, strict=True))
        ),
        lambda axes: axes.set_yticks([-180, -90, 0, 90, 180]),
        x=TIME,
        y=("phase", "°"),
        xlim=(0, None),
        ylim=(-190, 190),
        columns=3,
        height=3.5,
    )


def _results(gains: list[Record], amplitudes: list[Record]) -> Record:
    """What the paper says of Figs. 7 and 8, as it comes out here; None where no run is such."""
    quiet = [run["of"] for run in gains if not run["overshoots"]]
    loud = [run["of"] for run in gains if run["overshoots"]]
    turns = [_turn(run["phase_rad"]) for run in gains if run["overshoots"]]
    return {
        "largest_quiet_gain_s_per_m": max(quiet, default=None),
        "smallest_overshoot_gain_s_per_m": min(loud, default=None),
        "turn_rad": [min(turns), max(turns)] if turns else None,
        "misadjustments_of_figure_8": sum(run["misadjustments"] for run in amplitudes),
    }


def _turn(phase: list[float]) -> float:
    """Largest turn of the phase from one sample to the next, rad: that of the overshoot."""
    return max(abs(math.remainder(b - a, 2 * math.pi)) for a, b in pairwise(phase))


SECTION: Final = Section(
    name="paper_again", title="The paper’s figures, drawn again", collect=_collect, apart=True, show=_view
)
