"""Design of eccentric masses: masses, guide radius, gear and motor for an imbalance and a requirement.

The moment 2 m_b r_b follows from the imbalances of random devices, a mass is no lighter than the motor that
travels with it, and its length goes with the cube root of its mass.  Of each motor the gear is taken whose
smaller ratio to the need, of torque or speed, is largest; gains follow from the drives' inertia.  The
lightest designs are run; the lightest that serves enough devices gets settings by the search of `tune`, and
is judged on devices that took no part.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.eccentric_mass.devices import imbalance_ratios
from ringbalance.controller.eccentric_mass.plant import PlantParameters
from ringbalance.controller.eccentric_mass.scene_records import EccentricScene, MotorAtHand, eccentric_scene
from ringbalance.controller.eccentric_mass.static_answers import (
    required_residual,
    stall_ratio,
    starting_speed,
    whirl_per_imbalance,
)
from ringbalance.controller.eccentric_mass.targets import reach_of
from ringbalance.controller.eccentric_mass.tried_settings import sized_gains
from ringbalance.controller.judging.judge import (
    FIRST_CHOOSING_DEVICE,
    Judgement,
    best_of,
    judged_all,
    plain_settings,
)
from ringbalance.controller.judging.ranking import Ranking, ranked
from ringbalance.controller.judging.search import searched
from ringbalance.controller.judging.tuning import required_table
from ringbalance.controller.trials import rounded
from ringbalance.design.axes import Point
from ringbalance.design.choices import with_choices
from ringbalance.design.design_rows import misses, verdict_findings
from ringbalance.design.races import deal
from ringbalance.results.numbers import format_given, percent
from ringbalance.results.requirements import MET, MISSED
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import finite
from ringbalance.scene.describe import setting_text
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import raw_value_at, with_values_at
from ringbalance.scene.platform.processes import beside

_RADII: Final = (1.0, 0.8, 0.6)
"""Guide radii to try, over the largest that space leaves."""
_QUANTILE: Final = 0.99
"""Quantile of the devices' imbalances that the masses cancel."""
_SPARE: Final = 1.05
"""Moment of the masses over that."""
_MARGIN: Final = 2.0
"""Stall torque over need, and speed without load over the fastest needed."""
_FASTEST_MOVE_RAD_S: Final = 0.6
"""Speed of a mass that is needed at least: half a turn in five seconds."""
_SIZINGS: Final = 8
"""Steps of the fixed point of mass and length."""
_BATCH: Final = 6
_MOST_RUN: Final = 18
_MOST_VERDICTS: Final = 3
_DIGITS_UP: Final = 1.005
"""Factor before rounding to three digits by which a value is not rounded down."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MassCandidate:
    """A motor at a guide radius, with the masses and the gear that it needs."""

    motor: str
    """Name; empty: the scene's."""
    point: Point
    """Changes of the scene, SI."""
    moving: float
    """Mass of both masses, motors included, kg."""
    drive_over_need: float
    """Smaller of the ratios of torque and of speed to what is needed; infinite without a largest voltage."""
    against: Finding | None
    """Reason why it is not run; None: it can be."""
    judgement: Judgement | None = None
    """Judgement on few devices with the gains of the design; None: it was not run."""

    @property
    def fraction(self) -> float:
        """Fraction of the few devices that meet every demand; -1 without a run."""
        return self.judgement.fraction.value if self.judgement else -1.0


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MassDesign(Result):
    """Design of two eccentric masses with its verdict and the alternatives.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("washing_machine"))
        >>> design = rb.find_design(scene)
        >>> design.judgement.verdict
        'met'
    """

    scene: EccentricScene
    needed: float
    """Imbalance that nearly all devices stay below, with a margin, kg m."""
    candidates: tuple[MassCandidate, ...]
    """All, the lightest first."""
    best: MassCandidate | None
    """The design, or the nearest one; None: nothing can be run."""
    judgement: Judgement | None
    """Judgement of the best on devices that took no part; None: as for `best`."""
    ranking: Ranking

    @property
    def succeeded(self) -> bool:
        """True if the design meets the requirements."""
        return self.judgement is not None and self.judgement.verdict == MET

    @property
    def point(self) -> Point:
        """Changes of the scene, SI, without those of the search."""
        return self.best.point if self.best else {}

    @property
    def recommended_scene(self) -> EccentricScene:
        """Checked scene of the design. Raises: SceneError: no design can be run."""
        if self.judgement is None:
            problem, allowed = "no design can work", "other motors, more space or a smaller imbalance"
            raise SceneError.of_file(self.scene.file, problem, allowed)
        return self.scene.with_values({**self.point, **self.judgement.settings})

    def to_dict(self) -> dict[str, Any]:
        """The result as a JSON document, SI."""
        scene, judgement = self.scene, self.judgement
        return {
            "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
            "balancer": scene.balancer,
            "needed_unbalance_kg_m": self.needed,
            "reach_kg_m": reach_of(self.recommended_scene) if judgement else None,
            "motor": self.best.motor if self.best else "",
            "moving_mass_kg": self.best.moving if self.best else None,
            "changes": plain_settings(self.point),
            "settings": plain_settings(judgement.settings) if judgement else {},
            "asked": judgement.required_fraction if judgement else None,
            **(judgement.document() if judgement else {"verdict": MISSED, "fraction": None}),
            "required": judgement.demands_document() if judgement else [],
            "alternatives": [
                {
                    "motor": each.motor,
                    "changes": plain_settings(each.point),
                    "moving_mass_kg": each.moving,
                    "drive_over_need": finite(each.drive_over_need),
                    "against": each.against and each.against.text,
                    "fraction": each.judgement and each.judgement.fraction.document(),
                }
                for each in self.candidates
            ],
            "ranking": self.ranking.document(),
            **self.rows().document(),
        }

    def rows(self) -> Rows:
        """The design, what it must do, and the alternatives."""
        scene, best, judgement, tables = self.scene, self.best, self.judgement, list[Table]()
        needed = "imbalance of nearly all devices, with a margin"
        quantities = [Quantity(key="needed_unbalance", name=needed, value=self.needed, unit="kg m")]
        counts = {"points": len(self.candidates), "able": sum(not each.against for each in self.candidates)}
        findings = [Finding(code="mass_design_none", values={"points": counts["points"]})]
        if best is not None and judgement is not None:
            met, reach = "devices that meet what is required", reach_of(self.recommended_scene)
            over = "torque or speed of the drives over what is needed"
            quantities = [
                Quantity.of_fraction(judgement.fraction, key="fraction_met", name=met),
                Quantity(
                    key="moving_mass", name="both masses, motors included", value=best.moving, unit="kg"
                ),
                Quantity(key="reach", name="cancels in any direction", value=reach, unit="kg m"),
                Quantity(key="drive_over_need", name=over, value=best.drive_over_need),
                *quantities,
            ]
            quantities = [each for each in quantities if each.value != math.inf]
            counts["raced"] = sum(each.judgement is not None for each in self.candidates)
            findings = [
                *verdict_findings(scene, best.point, judgement),
                Finding(code="mass_design_looked", values={**counts}),
                *(() if self.succeeded else misses(judgement, self.ranking)),
            ]
            changes = [
                (path, setting_text(path, raw_value_at(scene, path)), setting_text(path, value))
                for path, value in {**best.point, **judgement.settings}.items()
            ]
            keys = "key", "the scene's", "designed"
            tables = [Table(caption="Design", heads=keys, rows=changes), required_table(judgement)]
        reasons = Counter(each.against.text for each in self.candidates if each.against)
        findings += [
            Finding(code="mass_design_against", values={"count": count, "text": text})
            for text, count in reasons.most_common(2 if judgement is None else 1)
        ]
        alternatives = [
            (
                each.motor or "the scene's",
                *(setting_text(path, each.point[path]) for path in ("masses.guide_radius", "masses.mass")),
                str(each.point["motor.teeth"][0]),
                format_given(finite(each.drive_over_need), "1", digits=2),
                percent(each.fraction)
                if each.judgement
                else (each.against.code if each.against else "not run").replace("_", " "),
            )
            for each in self.candidates
        ]
        heads = "motor", "guide radius", "each mass", "teeth of A", "drive over need", "devices that meet all"
        caption = "Alternatives, the lightest first; few devices, with the gains of the design"
        return Rows(
            title=f"Design for {scene.name} ({scene.source})",
            quantities=tuple(quantities),
            findings=tuple(findings),
            tables=(*tables, Table(caption=caption, heads=heads, rows=alternatives)),
        )


def design_masses(
    scene: EccentricScene,
    *,
    executor: Executor | None = None,
    workers: int = 1,
    progress: Callable[[str], None] | None = None,
) -> MassDesign:
    """Size masses, gear and motor for a scene; see `ringbalance.search.find_design`.

    Raises: SceneError: a rotor without imbalance or at rest, or a file of motors with errors.
    """
    report = progress or (lambda _: None)
    if not scene.imbalance.mass or not starting_speed(scene):
        problem, allowed = "no imbalance that masses could cancel", "a turning rotor with an imbalance"
        raise SceneError.of_file(scene.file, problem, allowed)
    needed = _SPARE * float(np.quantile(imbalance_ratios(scene), _QUANTILE)) * reach_of(scene)
    largest = scene.design.guide_radius
    radii = [scene.masses.guide_radius] if largest is None else [rounded(each * largest) for each in _RADII]
    at_hand: Sequence[MotorAtHand] = scene.design.motors
    if (file := scene.design.motor_file) is not None:
        folder = scene.checked.folder if scene.checked else None
        with_file = with_choices(scene, (folder or Path()) / file, MotorAtHand, among="design.motors")
        at_hand = eccentric_scene(with_file).design.motors
    candidates = sorted(
        (_candidate(scene, motor, radius, needed) for motor in at_hand or (None,) for radius in radii),
        key=lambda each: (each.against is not None, each.moving, -each.drive_over_need),
    )

    # The lightest run on few devices, until designs of a batch serve enough of them.
    able = [i for i, each in enumerate(candidates) if each.against is None][:_MOST_RUN]
    required, serving = balancer_of(scene).required_fraction(), list[MassCandidate]()
    with beside(workers + 1 if executor is None and workers > 1 else 1) as pool:
        for first in range(0, len(able), _BATCH):
            batch = able[first : first + _BATCH]
            report(f"designs {first + 1} to {first + len(batch)} of {len(able)}")
            calls = [partial(_looked_at, scene, candidates[i].point) for i in batch]
            for i, judgement in zip(batch, deal(executor or pool, calls), strict=True):
                candidates[i] = replace(candidates[i], judgement=judgement)
            serving = [each for each in candidates if each.fraction >= required]
            if serving:
                break
    nearest = sorted((each for each in candidates if each.judgement), key=lambda each: -each.fraction)[:1]

    # Fresh devices judge the lightest, each with the settings of a search, until one meets the requirement.
    best: MassCandidate | None = None
    verdict: Judgement | None = None
    ranking = Ranking()
    for best in serving[:_MOST_VERDICTS] or nearest:
        balancer = balancer_of(scene.with_values(best.point))
        settings = best_of(balancer, [searched(balancer, progress=report), {}], progress=report)
        (verdict,) = judged_all(balancer, [settings], progress=report)
        ranking = ranked(balancer, verdict)
        if verdict.verdict == MET:
            break
    return MassDesign(
        scene=scene,
        needed=needed,
        candidates=tuple(candidates),
        best=best,
        judgement=verdict,
        ranking=ranking,
    )


def _candidate(
    scene: EccentricScene, motor: MotorAtHand | None, radius: float, needed: float
) -> MassCandidate:
    """Masses, gear and gains for a motor at a guide radius."""
    point: dict[str, Any] = {"masses.guide_radius": radius}
    if motor is not None:
        keys = ("torque_constant", "resistance", "maximum_voltage")
        back_emf = motor.torque_constant if motor.back_emf_constant is None else motor.back_emf_constant
        point |= {f"motor.{key}": getattr(motor, key) for key in keys}
        point |= {"motor.back_emf_constant": back_emf, "motor.motor_inertia": motor.inertia}

    # The masses shade each other the more the longer they are, and are longer the heavier.
    before, mass = scene.masses, scene.masses.mass

    def arc_length() -> float:
        return float(before.arc_length * (mass / before.mass) ** (1 / 3))

    for _ in range(_SIZINGS):
        sized = {**point, "masses.mass": mass, "masses.arc_length": arc_length()}
        reach = reach_of(with_values_at(scene, sized))
        if reach <= 0 or arc_length() > math.pi * radius:
            break
        mass *= needed / reach
    mass = rounded(_DIGITS_UP * max(mass, motor.mass if motor else 0.0))
    point |= {"masses.mass": mass, "masses.arc_length": rounded(arc_length())}

    # The gear whose smaller ratio to the need, of stall torque or of speed without load, is largest.
    first, second, third = scene.motor.teeth
    drive_over_need, geared = -math.inf, scene
    for teeth in scene.design.teeth or tuple(factor * first for factor in (1, 2, 3, 4)):
        other = with_values_at(scene, {**point, "motor.teeth": (teeth, second, third)})
        plant, stall = PlantParameters.of(other), stall_ratio(other)
        fastest = max(scene.friction_filter.drive_speed, _FASTEST_MOVE_RAD_S)
        back_emf = plant.back_emf_constant * plant.gear_ratio * fastest
        free = plant.maximum_voltage / back_emf if back_emf else math.inf
        ratio = min(math.inf if stall is None else stall, free)
        if ratio > drive_over_need:
            drive_over_need, geared = ratio, other
    point["motor.teeth"] = list(geared.motor.teeth)

    against, most = None, scene.design.mass
    values: dict[str, Value] = {"mass": mass, "most": most, "radius": radius}
    if most is not None and mass > most:
        against = Finding(code="mass_too_heavy", values=values)
    elif drive_over_need < _MARGIN:
        values = {"name": motor.name if motor else "of the scene", "teeth": geared.motor.teeth[0]}
        values |= {"over": drive_over_need, "least": _MARGIN}
        against = Finding(code="motor_too_weak", values=values)
    try:
        residual = required_residual(geared)
        if residual is not None:
            # Left within the limit at the balancing speed, the vibration is within the residual at the last.
            start, last = starting_speed(scene), float(scene.rotor.profile[1][-1])
            grown = whirl_per_imbalance(geared, last) / whirl_per_imbalance(geared, start)
            point["supervisor.limit"] = rounded(residual / max(grown, 1.0) / _DIGITS_UP)
        point |= sized_gains(geared)
        scene.with_values(point)
    except SceneError as error:
        against = against or Finding(code="mass_design_refused", values={"text": str(error.faults[0])})
    name = motor.name if motor else ""
    return MassCandidate(
        motor=name, point=point, moving=2 * mass, drive_over_need=drive_over_need, against=against
    )


def _looked_at(scene: EccentricScene, point: Point) -> Judgement | None:
    """Judgement of a candidate on few devices; None: its runs are refused."""
    try:
        balancer = balancer_of(scene.with_values(point))
        few = balancer.verdict_draws[0]
        return judged_all(balancer, [{}], first=few, most=few, start=FIRST_CHOOSING_DEVICE)[0]
    except SceneError:
        return None
