"""`ringbalance verify`: the cases on the command line, as a table or as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from json import dumps
from pathlib import Path
from typing import Final

from ringbalance.results.numbers import percent
from ringbalance.results.result import Rows, Table, print_rows
from ringbalance.scene import AnyScene, liquid_ring_scene, load_scene
from ringbalance.scene.platform.display import display
from ringbalance.scene.platform.processes import checked_workers
from ringbalance.scene.platform.terminal import activity, print_error, results_console
from ringbalance.verification.case import CaseDefinition, CaseError
from ringbalance.verification.catalogue import (
    OwnCase,
    UnknownCaseError,
    load_case,
    own_cases,
    place,
    unknown_case,
)
from ringbalance.verification.catalogue import case_ids as program_ids
from ringbalance.verification.evidence import Level
from ringbalance.verification.result import CaseResult, definition_document, kind_text
from ringbalance.verification.runner import paper_scene, run_cases, run_definition, scene_of
from ringbalance.verification.verdicts import Verdict

_DONE: Final = 0
_FAILED: Final = 1
_BAD_INPUT: Final = 2


def verify(
    *case_ids: str,
    cases: Path | None = None,
    scene: Path | None = None,
    list_: bool = False,
    mutations: bool = False,
    level: Level = "light",
    json: bool = False,
    workers: int = 1,
    data: Path | None = None,
) -> int:
    """Run verification cases and judge the paper's claims.

    Args:
        case_ids: ids of the cases; none for all.
        cases: a folder with cases of your own (docs/verification-cases.md), which join the program's.
        scene: scene file; default the liquid-ring paper's disc.
        list_: name the cases and run none.
        mutations: also build in each case's mutations, which must change its verdict.
        level: "heavy" runs the cases that take long too.
        json: print one JSON document instead of a table.
        workers: processes to spread the cases over.
        data: a file of measurements (docs/measurements.md), predicted and judged instead of the cases.

    Returns:
        Exit code: 0; 1 when a code-verification case failed, or a mutation was not caught; 2 for an unknown
        case, a case that is not whole (the others are run), or measurements that cannot be used.

    Raises:
        SceneError: the scene file is not a scene.
    """
    if data is not None:
        return _judge_data(data, json=json)
    found, errors = own_cases(cases) if cases is not None else ([], [])
    own = {case.definition.id: case for case in found}
    try:
        chosen, more = _chosen(case_ids, own)
    except UnknownCaseError as error:
        # A case whose text cannot be read is unknown, too; what is wrong with it is said alone.
        said: Sequence[Exception] = errors or [error]
        for wrong in said:
            _say(wrong)
        return _BAD_INPUT
    errors += more
    if list_:
        _print_list(chosen, json=json)
    else:
        given = paper_scene() if scene is None else load_scene(scene)
        ids, workers = [definition.id for definition in chosen], checked_workers(workers)
        results, broken = _run(ids, own, scene=given, level=level, mutations=mutations, workers=workers)
        errors += broken
        if json:
            print(dumps([result.to_dict() for result in results], allow_nan=False))
        else:
            _print_results(results)
    for wrong in errors:
        _say(wrong)
    if errors:
        return _BAD_INPUT
    return _DONE if list_ else _exit_code(results)


def _say(error: Exception) -> None:
    print_error(f"ringbalance: {error}")


def _chosen(ids: Sequence[str], own: Mapping[str, OwnCase]) -> tuple[list[CaseDefinition], list[CaseError]]:
    """Cases by their ids, or all, the program's first; and what is wrong with some of them."""
    known = (*program_ids(), *own)
    unknown = [name for name in ids if name not in known]
    if unknown:
        raise unknown_case(unknown[0], known)
    chosen: list[CaseDefinition] = []
    errors = []
    for name in ids or known:
        try:
            chosen.append(own[name].definition if name in own else load_case(name))
        except CaseError as error:
            errors.append(error)
    if not ids:
        chosen.sort(key=lambda definition: (definition.id in own, place(definition)))
    return chosen, errors


def _run(
    ids: Sequence[str],
    own: Mapping[str, OwnCase],
    *,
    scene: AnyScene,
    level: Level,
    mutations: bool,
    workers: int,
) -> tuple[list[CaseResult], list[CaseError]]:
    """The results in the order of the cases, and what is wrong with the code of own ones."""
    results: dict[str, CaseResult] = {}
    errors: list[CaseError] = []
    with activity("verify", f"0 of {len(ids)} cases") as shown:

        def done(result: CaseResult) -> None:
            name, total = result.definition.id, len(ids)
            results[name] = result
            shown.show(f"{len(results)} of {total} cases, {name} done", done=len(results), total=total)

        if packaged := [name for name in ids if name not in own]:
            run_cases(packaged, scene=scene, level=level, mutations=mutations, workers=workers, progress=done)
        for case in (own[name] for name in ids if name in own):
            given = scene_of(case.definition, liquid_ring_scene(scene))
            try:
                done(
                    run_definition(
                        case.definition, case.code(), scene=given, level=level, mutations=mutations
                    )
                )
            except CaseError as error:
                errors.append(error)
    return [results[name] for name in ids if name in results], errors


def _judge_data(path: Path, *, json: bool) -> int:
    # What predicts every kind of measurement loads a compiler.
    from ringbalance.verification.validation.comparison import data_document  # noqa: PLC0415

    document = data_document(path)
    if json:
        print(dumps(document, allow_nan=False))
        return _DONE
    series = {**document["series"], "all": document["statistics"]}
    rows = Rows(
        title=f"{document['title']}  {document['verdict']} ({document['source']})",
        quantities=(),
        facts=[("confirmed", f"where at least {percent(document['limit'])} lie within both intervals")],
        tables=(
            Table(
                heads=("series", "points", "bias", "within"),
                rows=[
                    (
                        name,
                        f"{one['points']:.0f}",
                        percent(one["bias"], signed=True),
                        percent(one["share_within"], digits=3),
                    )
                    for name, one in series.items()
                ],
            ),
        ),
        listed=0,
    )
    print_rows(rows, headline=False)
    return _DONE


def _exit_code(results: Sequence[CaseResult]) -> int:
    """1 when a code-verification case failed or a mutation was not caught; a refuted claim is a result."""
    failed = any(
        result.broken or (result.definition.kind == "code_verification" and result.verdict is Verdict.FAILED)
        for result in results
    )
    return _FAILED if failed else _DONE


def _print_list(definitions: Sequence[CaseDefinition], *, json: bool) -> None:
    if json:
        print(dumps([definition_document(d) for d in definitions], allow_nan=False))
        return
    rows = [(d.id, kind_text(d), d.cost, d.title) for d in definitions]
    table = Table(heads=("case", "kind", "cost", "title"), rows=rows)
    cases = Rows(title=f"{len(rows)} cases", quantities=(), tables=(table,), listed=0)
    print_rows(cases, headline=False)


def _print_results(results: Sequence[CaseResult]) -> None:
    console = results_console()
    for result in () if display().brief else results:
        console.print(result.rows().view(headline=False), "")
    counts = Counter(result.verdict for result in results)
    total = ", ".join(f"{counts[verdict]} {verdict}" for verdict in Verdict if counts[verdict])
    if broken := sum(result.broken for result in results):
        total += f"; {broken} of these proves nothing, because a mutation was not caught"
    console.print(total)
