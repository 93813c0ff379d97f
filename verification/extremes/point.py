"""One point at the extremes: the whole way from a scene file to a closed loop, and what must hold on it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Final, Self

import numpy as np

from ringbalance.controller.document import simulation_document
from ringbalance.controller.loop import simulate
from ringbalance.controller.simulation import Simulation
from ringbalance.mesh.geometry import liquid_first_moment, surface_radius
from ringbalance.reduced_model.calibration import calibrate
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.documents import calibration_document
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.verification.extremes.axes import Point, scene_at
from ringbalance.verification.reference.chambers import exact_wall_pressure

ROUND_OFF: Final = 1e-12
"""Relative: what floating point may take from a conserved or monotone quantity."""
WIDE: Final = 1.0
"""Half-width over value from which on an answer is no more than an order of magnitude."""

_SOUND_SPEED: Final = 1480.0
"""m/s, in water at 20 degC."""
_BULK_MODULUS: Final = 2.2e9
"""Pa, of the same."""
_PLAIN_LIQUID: Final = (0.33, 0.05)
"""Of the speed of sound and of the bulk modulus, beyond which no answer may stand without a reservation."""


class Ending(StrEnum):
    """How a point ended."""

    SOLVED = "solved"
    WIDE = "solved, with a wide half-width"
    STATUS = "solved, with a reservation"
    REFUSED = "refused with a message"
    BROKEN = "broken"


@dataclass(frozen=True, kw_only=True)
class PointJudgement:
    """What became of one point."""

    ending: Ending
    text: str
    """The program's own message, or its reservation; empty where there is none."""
    violations: tuple[str, ...] = ()
    """What should have held and did not."""
    residual: float = 0.0
    """Largest relative residual of its linear solves."""
    worst_ratio: float = -1.0
    """Largest |error| over half-width against the closed form; -1 where gravity is modelled, without one."""
    loop: str = ""
    """Outcome of its closed loop."""

    @property
    def answered(self) -> bool:
        """Whether the point got an answer, with or without a reservation."""
        return self.ending not in (Ending.REFUSED, Ending.BROKEN)

    @classmethod
    def of_record(cls, record: dict[str, Any]) -> Self:
        """From plain data, as `judged` gives it and a file keeps it."""
        ending, violations = Ending(record["ending"]), tuple(record["violations"])
        return cls(**record | {"ending": ending, "violations": violations})


def judged(scene: Scene, point: Point, *, width_factor: float = 1.0, leak: float = 0.0) -> dict[str, Any]:
    """Take a scene at a point through calibration and closed loop, and look for anything that should not be.

    An exception other than a scene's error counts as broken, whatever it is.
    Args: `width_factor`: of every half-width of the chamber; other than 1 only to show that the judgement
        notices. `leak`: fraction of the liquid that is lost by the end of a run, likewise.
    Returns: The judgement as plain data.
    """
    try:
        varied = scene_at(scene, point)
        calibration = calibrate(varied)
        run = simulate(varied, calibration.model)
    except SceneError as error:
        # By its name alone: the path of the file is nothing of the scene's.
        text = str(error).replace(scene.file, scene.source)
        return asdict(PointJudgement(ending=Ending.REFUSED, text=text, violations=tuple(_unclear(error))))
    except Exception as error:
        # Whatever it is: finding it is what this is for.
        text = f"{type(error).__name__}: {error}"
        return asdict(PointJudgement(ending=Ending.BROKEN, text=text, violations=(f"exception {text}",)))
    ratio, status = _worst_ratio(calibration, width_factor), calibration.chamber.status
    violations = (*_calibration_faults(calibration, ratio), *_loop_faults(varied, run, leak))
    return asdict(
        PointJudgement(
            ending=Ending.BROKEN if violations else _ending(calibration),
            text="" if status.ok else status.text,
            violations=violations,
            residual=float(calibration.statistics["relative_residual"]),
            worst_ratio=ratio,
            loop=str(run.outcome),
        )
    )


def _unclear(error: SceneError) -> Iterator[str]:
    """A refusal has to name what is wrong and what would be accepted."""
    for fault in error.faults:
        if not (fault.key and fault.problem):
            yield f"a refusal that names no key: {fault}"


def _ending(calibration: Calibration) -> Ending:
    if not calibration.chamber.status.ok:
        return Ending.STATUS
    chamber = calibration.chamber
    width = float(chamber.moment_per_mass.uncertainty) / float(chamber.moment_per_mass.value)
    k, uncertainty_95 = calibration.tube.k.value, calibration.tube.k.uncertainty
    tube = float(np.median(uncertainty_95 / (np.abs(k) + 1)))
    return Ending.WIDE if max(width, tube) > WIDE else Ending.SOLVED


def _worst_ratio(calibration: Calibration, width_factor: float) -> float:
    """Of the finite elements against the concentric closed form, which is exact where gravity is left out."""
    chamber, scene = calibration.chamber, calibration.scene
    if chamber.check.gravity:
        return -1.0
    solved = chamber.check.elements
    x = solved.fill_ratio
    pressure = exact_wall_pressure(
        disc=scene.disc, density=scene.liquid.density, angular_velocity=abs(scene.rotor.speed), fill_ratio=x
    )
    a = surface_radius(disc=scene.disc, fill_ratio=x)
    swept = liquid_first_moment(disc=scene.disc, surface_radius=a)
    moment = scene.liquid.density * scene.disc.axial_width * swept
    worst = 0.0
    for estimate, exact in ((solved.wall_pressure, pressure), (solved.moment, moment)):
        allowed = width_factor * estimate.uncertainty + ROUND_OFF * np.abs(exact)
        error = np.abs(estimate.value - exact)
        worst = max(worst, float(np.max(error[allowed > 0] / allowed[allowed > 0], initial=0.0)))
    return worst


def _calibration_faults(calibration: Calibration, ratio: float) -> Iterator[str]:
    """Finite, monotone where physics is, half-widths that hold."""
    try:
        json.dumps(calibration_document(calibration), allow_nan=False)
    except ValueError:
        yield "a number in the calibration is not finite"
    if ratio > 1:
        yield f"an error is {ratio:.3g} times its half-width"
    nodes = calibration.chamber.wall_pressure.table.knots.size
    for name, curve in (
        ("wall pressure", calibration.chamber.wall_pressure),
        ("moment", calibration.chamber.moment),
    ):
        if np.any(curve.uncertainty < 0):
            yield f"a half-width of the {name} is negative"
        if not np.all(np.diff(curve.value[:nodes]) > 0):
            yield f"the {name} does not grow with the fill"
    tube = calibration.tube
    head = (tube.k.value + 1) * tube.reynolds**2
    if np.any(np.diff(head) <= 0):
        yield "the tube's head does not grow with the velocity"
    yield from _law_faults(calibration)
    yield from _absurd(calibration)


def _absurd(calibration: Calibration) -> Iterator[str]:
    """Velocities and pressures at which the liquid is nothing like one of a single density."""
    if not calibration.chamber.status.ok:
        return
    law, gas = calibration.flow_law, calibration.scene.gas.pressure
    fills = np.linspace(0.0, law.max_fill_ratio, 9)
    fastest = np.abs(law.evaluate(fill_ratio=fills, gas_pressure=gas, primed=True).velocity).max()
    if fastest > _PLAIN_LIQUID[0] * _SOUND_SPEED:
        yield f"{fastest:.3g} m/s in the tube without a reservation"
    highest = calibration.chamber.wall_pressure.value.max()
    if highest > _PLAIN_LIQUID[1] * _BULK_MODULUS:
        yield f"{highest / 1e6:.3g} MPa on the wall without a reservation"


def _law_faults(calibration: Calibration) -> Iterator[str]:
    law, scene = calibration.flow_law, calibration.scene
    fills = np.linspace(0.0, law.max_fill_ratio, 9)[:, None]
    pressure = np.linspace(0.0, 2.0, 9) * max(scene.gas.pressure, 1.0)
    for primed in (False, True):
        velocity = law.evaluate(
            fill_ratio=fills,
            opposite_fill_ratio=law.max_fill_ratio - fills,
            gas_pressure=pressure,
            primed=primed,
        ).velocity
        slack = ROUND_OFF + 1e-9 * np.abs(velocity).max()
        if not np.all(np.isfinite(velocity)):
            yield "a velocity of the law is not finite"
        elif np.any(np.diff(velocity, axis=1) < -slack):
            yield f"the velocity falls as the gas pressure grows ({'primed' if primed else 'empty'} tube)"


def _loop_faults(scene: Scene, run: Simulation, leak: float) -> Iterator[str]:
    """Ends with a text, conserves the liquid, keeps fills within bounds."""
    try:
        json.dumps(simulation_document(run), allow_nan=False)
    except ValueError:
        yield "a number in the run is not finite"
    if not run.status:
        yield "the run ended without a word"
    fills = np.array(list(run.fill_ratio.values()))
    fills[:, -1] *= 1 - leak
    largest = scene.disc.max_fill_ratio
    half = len(fills) // 2
    if np.any(np.abs(fills[:half] + fills[half:] - 2 * scene.disc.initial_fill) > ROUND_OFF * largest):
        yield "liquid is not conserved"
    if fills.min() < 0 or fills.max() > largest:
        yield "a fill ratio leaves its bounds"
