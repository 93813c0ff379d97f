"""Running cases and their mutations: one at a time or on several processes, in the order of the catalogue."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any, Literal

from ringbalance.scene import AnyScene, SceneError, bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.jobs import Job, answers_of
from ringbalance.scene.platform.processes import beside
from ringbalance.verification.assumptions import assumptions_of, overridden, widened
from ringbalance.verification.case import CaseDefinition, Mutation
from ringbalance.verification.catalogue import case_code, load_case, load_cases
from ringbalance.verification.evidence import CaseCode, Evidence, Level, NotRunError
from ringbalance.verification.papers import driven_scene
from ringbalance.verification.result import CaseResult, MutationResult, QuantityResult
from ringbalance.verification.verdicts import Verdict, combine

Progress = Callable[[CaseResult], None]
PAPER_SCENE = "liquid_ring_paper"
DRIVEN = "eccentric_mass"
"""The paper on eccentric masses."""
_ABOUT_A_SECTOR = (
    "it is about the sector between plates that the keys of [disc] give; this scene's chamber is imported"
)


@lru_cache(maxsize=1)
def paper_scene() -> Scene:
    """The liquid-ring paper's own disc."""
    return liquid_ring_scene(load_scene(bundled_scene(PAPER_SCENE)))


def run_case(case_id: str, *, scene: Scene, level: Level = "light", mutations: bool = False) -> CaseResult:
    """Run one case and judge it; one that cannot be run is `not run`, with the reason in its status.

    Args: `scene`: a case on the paper's own numbers takes the paper's disc instead. `level`: "light" leaves
        heavy cases unrun. `mutations`: whether each is built in and judged as well.
    Raises: KeyError: an unknown case.
    """
    definition, code = load_case(case_id), case_code(case_id)
    given = scene_of(definition, scene)
    return run_definition(definition, code, scene=given, level=level, mutations=mutations)


def run_definition(
    definition: CaseDefinition,
    code: CaseCode,
    *,
    scene: Scene,
    level: Level = "light",
    mutations: bool = False,
) -> CaseResult:
    """As `run_case`, of a case given by its text and its code, on the scene exactly as given."""
    result = _judged(definition, code, None, scene=scene, level=level)
    if not mutations or result.verdict is Verdict.NOT_RUN:
        return result
    affordable = [m for m in definition.must_fail if level == "heavy" or m.cost == "light"]
    pairs = [(m, _judged(definition, code, m, scene=scene, level=level)) for m in affordable]
    caught = tuple(
        MutationResult(
            id=mutation.id,
            what=mutation.what,
            expect=mutation.expect,
            verdict=mutated.verdict,
            status=mutated.status,
            judged=mutated.evidence is not None,
        )
        for mutation, mutated in pairs
    )
    return dataclasses.replace(result, mutations=caught)


def _judged(
    definition: CaseDefinition, code: CaseCode, mutation: Mutation | None, *, scene: Scene, level: Level
) -> CaseResult:
    """One run, with one of the case's mutations where one is given."""
    start = time.perf_counter()
    outcome = partial(_outcome, definition, scene=scene, level=level)
    if definition.cost == "heavy" and level == "light":
        return outcome(status="heavy: run with --level heavy")
    if definition.shape == "sector" and scene.mesh_digest:
        return outcome(status=_ABOUT_A_SECTOR)
    prescribed = {} if mutation is None else mutation.scene
    built_in = None if mutation is None or prescribed else mutation.id
    try:
        mutated = _mutated(scene, prescribed)
        evidence = code.compute(mutated, level, built_in)
        rests = [one for one in definition.rests_on if one.path not in prescribed]
        assumptions = assumptions_of(rests, mutated)
        at = partial(_evidence_at, code, level, built_in, (mutated, evidence))
        by_corners = [one for one in assumptions if not one.covered]
        evidence = widened(evidence, mutated, by_corners, at=at)
        quantities = _quantities(definition, evidence)
    except NotRunError as error:
        return outcome(status=str(error))
    except (ValueError, ArithmeticError, RuntimeError) as error:
        # A case that breaks down has not shown what it is there to show.
        verdict = Verdict.INCONCLUSIVE if definition.kind in ("claim", "validation") else Verdict.FAILED
        return outcome(status=f"{type(error).__name__}: {error}", verdict=verdict)
    verdict = combine(
        kind=definition.kind,
        verdicts=[result.verdict for result in quantities],
        roles=[result.quantity.judges for result in quantities],
    )
    if not evidence.status.ok and verdict not in (Verdict.FAILED, Verdict.REFUTED):
        verdict = Verdict.INCONCLUSIVE
    return dataclasses.replace(
        outcome(status=evidence.status.text, verdict=verdict),
        quantities=quantities,
        evidence=evidence,
        assumptions=assumptions,
        time_s=time.perf_counter() - start,
    )


def _mutated(scene: AnyScene, values: Mapping[str, float | Literal["absent"]]) -> Any:
    """The scene with a mutation's values: as a file would give them, where a file may."""
    if not values:
        return scene
    try:
        return scene.with_values(
            {path: None if value == "absent" else value for path, value in values.items()}
        )
    except SceneError:
        return overridden(scene, values)


def _evidence_at(
    code: CaseCode, level: Level, defect: str | None, known: tuple[Any, Evidence], scene: Any
) -> Evidence:
    """What is judged on another scene, by the case's shorter way to it where it has one.

    Args: `known`: a scene with its evidence.
    """
    shorter: Callable[[Any], Evidence] | None = getattr(code, "ends", None)
    try:
        if shorter is not None and defect is None:
            return shorter(scene)
        return known[1] if scene == known[0] else code.compute(scene, level, defect)
    except NotRunError as error:
        raise ValueError(f"not at every value of an assumed input: {error}") from error


def _quantities(definition: CaseDefinition, evidence: Evidence) -> tuple[QuantityResult, ...]:
    """Every quantity of a case. Raises: ValueError: what was found is not what the case judges."""
    names = {quantity.name for quantity in definition.quantity}
    if set(evidence.quantities) != names:
        raise ValueError(f"{definition.id}: judged are {sorted(names)}, found {sorted(evidence.quantities)}")
    return tuple(
        QuantityResult.of(definition.kind, quantity, evidence.quantities[quantity.name])
        for quantity in definition.quantity
    )


def _outcome(
    definition: CaseDefinition, *, scene: Scene, level: Level, status: str, verdict: Verdict = Verdict.NOT_RUN
) -> CaseResult:
    return CaseResult(
        definition=definition,
        verdict=verdict,
        quantities=tuple(QuantityResult(quantity=q, verdict=verdict) for q in definition.quantity),
        evidence=None,
        status=status,
        level=level,
        scene_name=scene.name,
        scene_sha256=scene.values_sha256,
    )


def scene_of(definition: CaseDefinition, scene: Scene) -> Any:
    """What a case is run on: the scene at hand, the paper's own disc or its rotor with eccentric masses."""
    if definition.paper == DRIVEN:
        return driven_scene()
    return paper_scene() if definition.judged_on == "paper" else scene


def run_cases(
    case_ids: Sequence[str] = (),
    *,
    scene: AnyScene,
    level: Level = "light",
    mutations: bool = False,
    workers: int = 1,
    progress: Progress | None = None,
) -> tuple[CaseResult, ...]:
    """Run several cases, or all, and return their results in the order asked for.

    An interrupt ends the run and leaves no process behind.
    Args: `level`: "light" leaves heavy cases `not run`. `workers`: processes, this one included. `progress`:
        called with each result as it comes, in order.
    Raises: KeyError: an unknown case.
    Raises: SceneError: a balancer without liquid.
    """
    scene = liquid_ring_scene(scene)
    wanted = tuple(case_ids) or tuple(definition.id for definition in load_cases())
    results: dict[str, CaseResult] = {}
    reported = 0
    with beside(workers) as pool:
        jobs = case_jobs(wanted, scene=scene, level=level, mutations=mutations, apart=pool is None)
        for _, ended in answers_of(jobs, pool):
            results |= {result.definition.id: result for result in ended}
            while reported < len(wanted) and wanted[reported] in results:
                if progress is not None:
                    progress(results[wanted[reported]])
                reported += 1
    return tuple(results[case] for case in wanted)


def case_jobs(
    case_ids: Sequence[str], *, scene: Scene, level: Level, mutations: bool, apart: bool = False
) -> list[Job]:
    """Jobs that run some cases, each job's answer a tuple of results; options as of `run_case`.

    First the one that takes longest when nothing is compiled yet: the eccentric masses' cases run one
    compiled strategy, which is compiled once where one process runs them all.
    Args: `apart`: whether every case is a job of its own.
    """
    driven = () if apart else tuple(case for case in case_ids if load_case(case).paper == DRIVEN)
    groups = [driven] if driven else []
    groups += [(case,) for case in case_ids if case not in driven]
    run = partial(run_case, scene=scene, level=level, mutations=mutations)
    return [
        Job(
            name=f"case {group[0]}",
            do=partial(_run_group, run, group),
            title=", ".join(load_case(case).title for case in group),
        )
        for group in dict.fromkeys(groups)
    ]


def _run_group(run: Callable[[str], CaseResult], group: Sequence[str]) -> tuple[CaseResult, ...]:
    return tuple(run(case) for case in group)
