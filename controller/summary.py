"""Runs, tunings and comparisons in a few lines."""

from __future__ import annotations

from collections.abc import Iterator

from ringbalance.controller.compare import Comparison
from ringbalance.controller.eccentric_mass.run_record import EccentricRun
from ringbalance.controller.eccentric_mass.tuning import EccentricTuning
from ringbalance.controller.tuning.settling import SettlingTimes
from ringbalance.controller.tuning.tune import Tuning


def eccentric_lines(run: EccentricRun) -> Iterator[str]:
    """Of eccentric masses."""
    yield f"Run of {run.scene} ({run.source}): eccentric masses"
    yield _amplitudes(run.amplitude[0], run.final_amplitude, run.limit, run.time[-1])
    yield f"largest amplitude {_um(run.worst_amplitude)}, {run.electrical_energy:.4g} J of the motors"
    yield f"stages: {', '.join(stage.name for stage in run.stages)}"
    yield run.status


def tuning_lines(tuning: Tuning) -> Iterator[str]:
    """Of a liquid ring."""
    scene = tuning.scene
    yield f"Tuning of {scene.name} ({scene.source}): {tuning.law} law, controller {scene.controller.kind}"
    if tuning.gain is not None:
        yield f"recommended gain {tuning.gain / 1e6:.4g} s/um (controller.proportional)"
    if tuning.loop.value is not None:
        yield f"loop factor {tuning.loop.value:.3g} of at most {tuning.loop.limit:.3g}"
    yield from _settling(tuning.settling)
    yield tuning.status


def eccentric_tuning_lines(tuning: EccentricTuning) -> Iterator[str]:
    """Of eccentric masses."""
    yield f"Tuning of {tuning.scene.name} ({tuning.scene.source}): eccentric masses"
    values = (f"{loop.key} {loop.recommended:.4g} {loop.unit}".rstrip() for loop in tuning.gains.loops)
    yield f"largest values with a gain margin of two: {', '.join(values)}"
    yield f"voltage held for at most {tuning.gains.step:.4g} s"
    yield from _settling(None if tuning.settling is None else tuning.settling.times)
    yield tuning.status


def comparison_lines(comparison: Comparison) -> Iterator[str]:
    """Both balancers on the rotor."""
    yield f"Two balancers on the rotor of {comparison.rotor.source}, {comparison.span:.4g} s each"
    for side in comparison.sides:
        time = "not settled" if side.time is None else f"settled after {side.time:.3g} s"
        left = f"residual {side.middle('residual_ratio'):.3g}, energy {side.middle('energy'):.4g} J"
        yield f"{side.scene.name} ({side.scene.balancer}): {time}, {left}"
    yield f"medians of {len(comparison.sides[0].results)} runs each"


def _settling(times: SettlingTimes | None) -> Iterator[str]:
    if times is not None:
        ends = f"{times.settled.low:.3g} to {times.settled.high:.3g}"
        yield f"fraction of runs that settle {times.settled.value:.3g} (95 %: {ends}; {times.runs} runs)"


def _amplitudes(first: float, last: float, limit: float, end: float) -> str:
    return f"amplitude {_um(first)} to {_um(last)} in {end:.4g} s, limit {_um(limit)}"


def _um(length: float) -> str:
    return f"{1e6 * length:.4g} um"
