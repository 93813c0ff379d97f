"""Running cases and their mutations: one at a time or on several processes, in the order of the catalogue."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any

from ringbalance.scene import AnyScene, SceneError, bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.models import Scene
from ringbalance.scene.platform.jobs import Job, answers_of
from ringbalance.scene.platform.processes import beside
from ringbalance.verification.assumptions import Assumption, assumptions_of, overridden, widened
from ringbalance.verification.case import CaseDefinition, Mutation
from ringbalance.verification.catalogue import case_code, load_case, load_cases
from ringbalance.verification.evidence import CaseCode, Evidence, Level, NotRunError
from ringbalance.verification.papers import driven_scene
from ringbalance.verification.result import CaseResult, MutationResult, QuantityResult
from ringbalance.verification.verdicts import Verdict, combine

Progress = Callable[[CaseResult], None]
PAPER_SCENE = "liquid_ring_paper"
DRIVEN = "eccentric_mass"
"""Key of the paper on eccentric masses."""
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
        heavy cases unrun. `mutations`: True to build in and judge each of them as well.
    Raises: KeyError: an unknown case.
    """
    definition, code = load_case(case_id), case_code(case_id)
    case_scene = scene_of(definition, scene)
    return run_definition(definition, code, scene=case_scene, level=level, mutations=mutations)


def run_definition(
    definition: CaseDefinition,
    code: CaseCode,
    *,
    scene: Scene,
    level: Level = "light",
    mutations: bool = False,
) -> CaseResult:
    """Run a case by its text and its code, on exactly this scene; options as of `run_case`."""
    result = _judged(definition, code, None, scene=scene, level=level)
    if not mutations or result.verdict is Verdict.NOT_RUN:
        return result
    caught = []
    for mutation in definition.must_fail:
        if level == "heavy" or mutation.cost == "light":
            mutated = _judged(definition, code, mutation, scene=scene, level=level)
            caught.append(
                MutationResult(
                    mutation=mutation,
                    verdict=mutated.verdict,
                    status=mutated.status,
                    judged=mutated.evidence is not None,
                )
            )
    return dataclasses.replace(result, mutations=tuple(caught))


def _judged(
    definition: CaseDefinition, code: CaseCode, mutation: Mutation | None, *, scene: AnyScene, level: Level
) -> CaseResult:
    """One run, with one of the case's mutations where one is given."""
    start = time.perf_counter()

    def without_evidence(status: str, verdict: Verdict = Verdict.NOT_RUN) -> CaseResult:
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

    if definition.cost == "heavy" and level == "light":
        return without_evidence("heavy: run with --level heavy")
    if definition.shape == "sector" and scene.mesh_digest:
        return without_evidence(_ABOUT_A_SECTOR)
    try:
        evidence, assumptions = _evidence(definition, code, mutation, scene, level)
        judged, computed = {each.name for each in definition.quantity}, evidence.quantities
        if set(computed) != judged:
            raise ValueError(f"{definition.id}: judged are {sorted(judged)}, found {sorted(computed)}")
        quantities = tuple(
            QuantityResult.of(definition.kind, each, computed[each.name]) for each in definition.quantity
        )
    except NotRunError as error:
        return without_evidence(str(error))
    except (ValueError, ArithmeticError, RuntimeError) as error:
        # A case that breaks down proves nothing.
        failed = Verdict.INCONCLUSIVE if definition.kind in ("claim", "validation") else Verdict.FAILED
        return without_evidence(f"{type(error).__name__}: {error}", failed)
    verdict = combine(
        kind=definition.kind,
        verdicts=[result.verdict for result in quantities],
        roles=[result.quantity.judges for result in quantities],
    )
    if not evidence.status.ok and verdict not in (Verdict.FAILED, Verdict.REFUTED):
        verdict = Verdict.INCONCLUSIVE
    return dataclasses.replace(
        without_evidence(evidence.status.text, verdict),
        quantities=quantities,
        evidence=evidence,
        assumptions=assumptions,
        time_s=time.perf_counter() - start,
    )


def _evidence(
    definition: CaseDefinition, code: CaseCode, mutation: Mutation | None, scene: AnyScene, level: Level
) -> tuple[Evidence, tuple[Assumption, ...]]:
    """Evidence of a case with the reach of its assumed inputs, and these inputs."""
    overrides = {} if mutation is None else mutation.scene
    defect = None if mutation is None or overrides else mutation.id
    mutated: Any = scene
    if overrides:
        try:
            # Checked like a scene file, unless such values are not allowed in one.
            mutated = scene.with_values({k: None if v == "absent" else v for k, v in overrides.items()})
        except SceneError:
            mutated = overridden(scene, overrides)
    evidence = code.compute(mutated, level, defect)
    needed = [each for each in definition.rests_on if each.path not in overrides]
    assumptions = assumptions_of(needed, mutated)
    shorter: Callable[[Any], Evidence] | None = getattr(code, "ends", None)

    def evidence_at(varied: Any) -> Evidence:
        """Evidence on another scene, by the case's `ends` where it has such a function."""
        try:
            if shorter is not None and defect is None:
                return shorter(varied)
            return evidence if varied == mutated else code.compute(varied, level, defect)
        except NotRunError as error:
            raise ValueError(f"not at every value of an assumed input: {error}") from error

    by_corners = [each for each in assumptions if not each.covered]
    return widened(evidence, mutated, by_corners, at=evidence_at), assumptions


def scene_of(definition: CaseDefinition, scene: Scene) -> Any:
    """Scene that a case is run on: the given one, the paper's disc, or its rotor with eccentric masses."""
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
    Args: `level`: "light" leaves heavy cases `not run`. `mutations`: also with each case's mutations.
        `workers`: processes, this one included. `progress`: called with each result as it comes, in order.
    Raises: KeyError: an unknown case.
    Raises: SceneError: a balancer without liquid.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> (case,) = rb.run_cases(["claim_01_volume"], scene=scene)
        >>> case.verdict.value
        'confirmed'
    """
    scene = liquid_ring_scene(scene)
    ids = tuple(case_ids) or tuple(definition.id for definition in load_cases())
    results: dict[str, CaseResult] = {}
    reported = 0
    with beside(workers) as pool:
        jobs = case_jobs(ids, scene=scene, level=level, mutations=mutations, apart=pool is None)
        for _, group in answers_of(jobs, pool):
            results |= {result.definition.id: result for result in group}
            while reported < len(ids) and ids[reported] in results:
                if progress is not None:
                    progress(results[ids[reported]])
                reported += 1
    return tuple(results[case] for case in ids)


def case_jobs(
    case_ids: Sequence[str], *, scene: Scene, level: Level, mutations: bool, apart: bool = False
) -> list[Job]:
    """Jobs that run some cases, each job's answer a tuple of results; options as of `run_case`.

    The first job takes longest when nothing is compiled yet: the cases on eccentric masses share a compiled
    strategy, so one process runs them all and compiles it once.
    Args: `apart`: True to make every case a separate job.
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
