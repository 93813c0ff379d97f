"""One point at the extremes: from scene file to closed loop, with the invariants that must hold."""

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
"""Relative change of a conserved or monotone quantity that counts as rounding."""
WIDE_RATIO: Final = 1.0
"""Half-width over value from which on a result is only an order of magnitude."""

_MAX_PLAIN_VELOCITY_M_S: Final = 0.33 * 1480.0
"""A third of the speed of sound in water at 20 degC, m/s; beyond, every answer needs a reservation."""
_MAX_PLAIN_PRESSURE_PA: Final = 0.05 * 2.2e9
"""A twentieth of the bulk modulus of water at 20 degC, Pa; beyond, every answer needs a reservation."""


class Ending(StrEnum):
    """Outcome of a point."""

    SOLVED = "solved"
    WIDE = "solved, with a wide half-width"
    STATUS = "solved, with a reservation"
    REFUSED = "refused with a message"
    BROKEN = "broken"


@dataclass(frozen=True, kw_only=True)
class PointJudgement:
    """Outcome of one point, with the invariants that it violates."""

    ending: Ending
    text: str
    """The program's own message, or its reservation; empty where there is none."""
    violations: tuple[str, ...] = ()
    """Violated invariants, in words."""
    residual: float = 0.0
    """Largest relative residual of its linear solves."""
    worst_ratio: float = -1.0
    """Largest |error| over half-width against the closed form; -1 where gravity is modelled, without one."""
    loop: str = ""
    """Outcome of its closed loop."""

    @property
    def answered(self) -> bool:
        """True if the point got an answer, with or without a reservation."""
        return self.ending not in (Ending.REFUSED, Ending.BROKEN)

    @classmethod
    def of_record(cls, record: dict[str, Any]) -> Self:
        """Read a record of `judged` from a file."""
        ending, violations = Ending(record["ending"]), tuple(record["violations"])
        return cls(**record | {"ending": ending, "violations": violations})


def judged(scene: Scene, point: Point, *, width_factor: float = 1.0, leak: float = 0.0) -> dict[str, Any]:
    """Take a scene at a point through calibration and closed loop, and check all invariants.

    An exception other than a scene's error counts as broken, whatever it is.
    Args: `width_factor`: of every half-width of the chamber; other than 1 only as a mutation. `leak`:
        fraction of the liquid that is lost by the end of a run; above 0 only as a mutation.
    Returns: The judgement as plain data.
    """
    try:
        varied = scene_at(scene, point)
        calibration = calibrate(varied)
        run = simulate(varied, calibration.model)
    except SceneError as error:
        # A refusal has to name what is wrong and what would be accepted.
        unclear = [
            f"a refusal that names no key: {fault}"
            for fault in error.faults
            if not (fault.key and fault.problem)
        ]
        # With the scene's name instead of its path, which depends on the machine.
        text = str(error).replace(scene.file, scene.source)
        return asdict(PointJudgement(ending=Ending.REFUSED, text=text, violations=tuple(unclear)))
    except Exception as error:
        # Any other exception is an error of the program, which this study looks for.
        text = f"{type(error).__name__}: {error}"
        return asdict(PointJudgement(ending=Ending.BROKEN, text=text, violations=(f"exception {text}",)))
    chamber, k = calibration.chamber, calibration.tube.k
    ratio = _worst_ratio(calibration, width_factor)
    violations = (*_calibration_faults(calibration, ratio), *_loop_faults(varied, run, leak))
    lever_width = float(chamber.moment_per_mass.uncertainty) / float(chamber.moment_per_mass.value)
    k_width = float(np.median(k.uncertainty / (np.abs(k.value) + 1)))
    if violations:
        ending = Ending.BROKEN
    elif not chamber.status.ok:
        ending = Ending.STATUS
    else:
        ending = Ending.WIDE if max(lever_width, k_width) > WIDE_RATIO else Ending.SOLVED
    return asdict(
        PointJudgement(
            ending=ending,
            text="" if chamber.status.ok else chamber.status.text,
            violations=violations,
            residual=float(calibration.statistics["relative_residual"]),
            worst_ratio=ratio,
            loop=str(run.outcome),
        )
    )


def _worst_ratio(calibration: Calibration, width_factor: float) -> float:
    """Largest |error| over half-width of the finite elements; -1 where gravity is modelled.

    Errors are against the concentric closed form, which is exact without gravity.
    """
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
    """Violations: numbers not finite, not monotone where physics is, or with errors above half-widths."""
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
    """Violations: velocities and pressures at which the liquid cannot be taken as incompressible."""
    if not calibration.chamber.status.ok:
        return
    law, gas = calibration.flow_law, calibration.scene.gas.pressure
    fills = np.linspace(0.0, law.max_fill_ratio, 9)
    fastest = np.abs(law.evaluate(fill_ratio=fills, gas_pressure=gas, primed=True).velocity).max()
    if fastest > _MAX_PLAIN_VELOCITY_M_S:
        yield f"{fastest:.3g} m/s in the tube without a reservation"
    highest = calibration.chamber.wall_pressure.value.max()
    if highest > _MAX_PLAIN_PRESSURE_PA:
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
    """Violations: a run without a closing text, lost liquid, or fills out of bounds."""
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
