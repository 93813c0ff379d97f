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
from collections.abc import Callable, Iterator, Sequence
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
from ringbalance.design.choices import NAME, read_choices
from ringbalance.design.design_rows import misses, verdict_findings
from ringbalance.design.races import deal
from ringbalance.results.numbers import format_given, percent
from ringbalance.results.requirements import MET, MISSED
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import finite
from ringbalance.scene.describe import setting_text
from ringbalance.scene.faults import SceneError
from ringbalance.scene.keys.declaration import keys_of
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
            "changes": plain_settings(self.point) if judgement else {},
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
        scene, judgement, tables = self.scene, self.judgement, list[Table]()
        if judgement is not None:
            changes = {**self.point, **judgement.settings}
            rows = [
                (path, setting_text(path, raw_value_at(scene, path)), setting_text(path, value))
                for path, value in changes.items()
            ]
            tables += [
                Table(caption="Design", heads=("key", "the scene's", "designed"), rows=rows),
                required_table(judgement),
            ]
        heads = (
            "motor",
            "guide radius",
            "each mass",
            "teeth of A",
            "drive over need",
            "devices that meet all",
        )
        alternatives = [
            (
                each.motor or "the scene's",
                setting_text("masses.guide_radius", each.point["masses.guide_radius"]),
                setting_text("masses.mass", each.point["masses.mass"]),
                str(each.point["motor.teeth"][0]),
                format_given(finite(each.drive_over_need), "1", digits=2),
                percent(each.judgement.fraction.value)
                if each.judgement
                else (each.against.code if each.against else "not run").replace("_", " "),
            )
            for each in self.candidates
        ]
        caption = "Alternatives, the lightest first; few devices, with the gains of the design"
        tables.append(Table(caption=caption, heads=heads, rows=alternatives))
        return Rows(
            title=f"Design for {scene.name} ({scene.source})",
            quantities=tuple(self._quantities()),
            findings=tuple(self._findings()),
            tables=tuple(tables),
        )

    def _quantities(self) -> Iterator[Quantity]:
        if self.judgement is not None and self.best is not None:
            name = "devices that meet what is required"
            yield Quantity.of_fraction(self.judgement.fraction, key="fraction_met", name=name)
            reach = reach_of(self.recommended_scene)
            for key, name, value, unit in (
                ("moving_mass", "both masses, motors included", self.best.moving, "kg"),
                ("reach", "cancels in any direction", reach, "kg m"),
                (
                    "drive_over_need",
                    "torque or speed of the drives over what is needed",
                    self.best.drive_over_need,
                    "1",
                ),
            ):
                if math.isfinite(value):
                    yield Quantity(key=key, name=name, value=value, unit=unit, digits=4)
        name = "imbalance of nearly all devices, with a margin"
        yield Quantity(key="needed_unbalance", name=name, value=self.needed, unit="kg m", digits=4)

    def _findings(self) -> Iterator[Finding]:
        judgement, able = self.judgement, sum(each.against is None for each in self.candidates)
        if judgement is None:
            yield Finding(code="mass_design_none", values={"points": len(self.candidates)})
        else:
            yield from verdict_findings(self.scene, self.point, judgement)
            ran = sum(each.judgement is not None for each in self.candidates)
            values: dict[str, Value] = {"points": len(self.candidates), "able": able, "raced": ran}
            yield Finding(code="mass_design_looked", values=values)
            if not self.succeeded:
                yield from misses(judgement, self.ranking)
        reasons = Counter(each.against.text for each in self.candidates if each.against)
        for text, count in reasons.most_common(2 if judgement is None else 1):
            yield Finding(code="mass_design_against", values={"count": count, "text": text})


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
        problem, allowed = (
            "there is no imbalance that masses could cancel",
            "a turning rotor with an imbalance",
        )
        raise SceneError.of_file(scene.file, problem, allowed)
    needed = _SPARE * float(np.quantile(imbalance_ratios(scene), _QUANTILE)) * reach_of(scene)
    largest = scene.design.guide_radius
    radii = [scene.masses.guide_radius] if largest is None else [rounded(each * largest) for each in _RADII]
    motors: Sequence[MotorAtHand | None] = _motors(scene) or (None,)
    candidates = sorted(
        (_candidate(scene, motor, radius, needed) for motor in motors for radius in radii),
        key=lambda each: (each.against is not None, each.moving, -each.drive_over_need),
    )
    able = [i for i, each in enumerate(candidates) if each.against is None][:_MOST_RUN]
    required = balancer_of(scene).required_fraction()

    def serving() -> list[int]:
        ran = [(i, each.judgement) for i, each in enumerate(candidates) if each.judgement]
        return [i for i, each in ran if each.fraction.value >= required]

    with beside(workers + 1 if executor is None and workers > 1 else 1) as pool:
        for first in range(0, len(able), _BATCH):
            batch = able[first : first + _BATCH]
            report(f"designs {first + 1} to {first + len(batch)} of {len(able)}")
            calls = [partial(_looked_at, scene, candidates[i].point) for i in batch]
            for i, judgement in zip(batch, deal(executor or pool, calls), strict=True):
                candidates[i] = replace(candidates[i], judgement=judgement)
            if serving():
                break
    ran = [each for each in candidates if each.judgement]
    nearest = sorted(ran, key=lambda each: -each.judgement.fraction.value if each.judgement else 0.0)[:1]
    best: MassCandidate | None = None
    verdict: Judgement | None = None
    ranking = Ranking()
    for best in [candidates[i] for i in serving()][:_MOST_VERDICTS] or nearest:
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


def _motors(scene: EccentricScene) -> tuple[MotorAtHand, ...]:
    """Motors at hand. Raises: SceneError: every error of their file."""
    file = scene.design.motor_file
    if file is None:
        return scene.design.motors
    folder, declared = scene.checked.folder if scene.checked else None, keys_of(MotorAtHand)
    rows = read_choices(
        (folder or Path()) / file,
        table="design.motors",
        keys={name: declared[name] for name in declared if name != NAME},
    )
    names = rows.names or tuple(f"motor {number}" for number in range(1, len(rows.rows) + 1))
    motors = [
        {NAME: name, **{key: value for key, value in row.items() if value is not None}}
        for name, row in zip(names, rows.rows, strict=True)
    ]
    changes = {"design.motors": motors, "design.motor_file": None}
    return eccentric_scene(scene.with_values(changes)).design.motors


def _candidate(
    scene: EccentricScene, motor: MotorAtHand | None, radius: float, needed: float
) -> MassCandidate:
    """Masses, gear and gains for a motor at a guide radius."""
    point: dict[str, Any] = {"masses.guide_radius": radius}
    if motor is not None:
        back_emf = motor.back_emf_constant
        point |= {
            "motor.torque_constant": motor.torque_constant,
            "motor.back_emf_constant": motor.torque_constant if back_emf is None else back_emf,
            "motor.resistance": motor.resistance,
            "motor.motor_inertia": motor.inertia,
            "motor.maximum_voltage": motor.maximum_voltage,
        }
    # The masses shade each other the more the longer they are, and are longer the heavier.
    before, mass, lightest = scene.masses, scene.masses.mass, motor.mass if motor else 0.0
    for _ in range(_SIZINGS):
        length = before.arc_length * (mass / before.mass) ** (1 / 3)
        sized = with_values_at(scene, {**point, "masses.mass": mass, "masses.arc_length": length})
        reach = reach_of(sized)
        if reach <= 0 or length > math.pi * radius:
            break
        mass *= needed / reach
    mass = rounded(_DIGITS_UP * max(mass, lightest))
    point |= {"masses.mass": mass}
    point["masses.arc_length"] = rounded(before.arc_length * (mass / before.mass) ** (1 / 3))
    first, second, third = scene.motor.teeth
    gears = scene.design.teeth or tuple(factor * first for factor in (1, 2, 3, 4))
    geared = {
        teeth: with_values_at(scene, {**point, "motor.teeth": (teeth, second, third)}) for teeth in gears
    }
    ratios = {teeth: _drive_over_need(each) for teeth, each in geared.items()}
    teeth = max(ratios, key=lambda each: ratios[each])
    point["motor.teeth"] = [teeth, second, third]
    against = None
    most, drive_over_need = scene.design.mass, ratios[teeth]
    try:
        if most is not None and mass > most:
            values: dict[str, Value] = {"mass": mass, "most": most, "radius": radius}
            against = Finding(code="mass_too_heavy", values=values)
        elif drive_over_need < _MARGIN:
            name = motor.name if motor else "of the scene"
            values = {"name": name, "over": drive_over_need, "least": _MARGIN, "teeth": teeth}
            against = Finding(code="motor_too_weak", values=values)
        residual = required_residual(geared[teeth])
        if residual is not None:
            # Left within the limit at the balancing speed, the vibration is within the residual at the last.
            last = float(scene.rotor.profile[1][-1])
            grown = whirl_per_imbalance(geared[teeth], last) / whirl_per_imbalance(
                geared[teeth], starting_speed(scene)
            )
            point["supervisor.limit"] = rounded(residual / max(grown, 1.0) / _DIGITS_UP)
        point |= sized_gains(geared[teeth])
        scene.with_values(point)
    except SceneError as error:
        against = against or Finding(code="mass_design_refused", values={"text": str(error.faults[0])})
    return MassCandidate(
        motor=motor.name if motor else "",
        point=point,
        moving=2 * mass,
        drive_over_need=drive_over_need,
        against=against,
    )


def _drive_over_need(scene: EccentricScene) -> float:
    """Smaller of stall torque and of speed without load, each over what is needed."""
    plant, stall = PlantParameters.of(scene), stall_ratio(scene)
    fastest = max(scene.friction_filter.drive_speed, _FASTEST_MOVE_RAD_S)
    back_emf = plant.back_emf_constant * plant.gear_ratio
    free = plant.maximum_voltage / (back_emf * fastest) if back_emf else math.inf
    return min(math.inf if stall is None else stall, free)


def _looked_at(scene: EccentricScene, point: Point) -> Judgement | None:
    """Judgement of a candidate on few devices; None: its runs are refused."""
    try:
        balancer = balancer_of(scene.with_values(point))
        few = balancer.verdict_draws[0]
        return judged_all(balancer, [{}], first=few, most=few, start=FIRST_CHOOSING_DEVICE)[0]
    except SceneError:
        return None
