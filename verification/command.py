"""`ringbalance verify`: the cases on the command line, as a table or as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from json import dumps
from types import SimpleNamespace
from typing import Any, Final

from ringbalance.results.numbers import percent
from ringbalance.results.result import Rows, Table, print_rows
from ringbalance.scene import liquid_ring_scene, load_scene
from ringbalance.scene.origins import summary_text
from ringbalance.scene.platform.display import display
from ringbalance.scene.platform.terminal import activity, print_error, results_console
from ringbalance.scene.registry import registered
from ringbalance.verification.case import CaseDefinition, CaseError
from ringbalance.verification.catalogue import OwnCase, load_case, own_cases, report_order, unknown_case
from ringbalance.verification.catalogue import case_ids as program_ids
from ringbalance.verification.result import CaseResult, definition_document, kind_text
from ringbalance.verification.runner import paper_scene, run_cases, run_definition, scene_of
from ringbalance.verification.verdicts import Verdict

_BAD_INPUT: Final = 2


def verify(options: SimpleNamespace) -> int:
    """Run the command `verify`. Returns: Exit code."""
    if options.data is not None:
        documents = [registered("function", "data_document")(file) for file in options.data]
        if options.json:
            print(dumps(documents[0] if len(documents) == 1 else documents, allow_nan=False))
        for document in () if options.json else documents:
            _print_judgement(document)
        return 0
    user_cases, errors = own_cases(options.cases) if options.cases is not None else ([], [])
    users = {case.definition.id: case for case in user_cases}
    ids = (*program_ids(), *users)
    if unknown := [name for name in options.case_ids if name not in ids]:
        # The id of an unreadable case is unknown, too: then its reading error alone is reported.
        problems: Sequence[Exception] = errors or [unknown_case(unknown[0], ids)]
        for problem in problems:
            print_error(f"ringbalance: {problem}")
        return _BAD_INPUT
    definitions: list[CaseDefinition] = []
    for name in options.case_ids or ids:
        try:
            definitions.append(users[name].definition if name in users else load_case(name))
        except CaseError as error:
            errors.append(error)
    if not options.case_ids:
        definitions.sort(key=lambda definition: (definition.id in users, report_order(definition)))
    results: list[CaseResult] = []
    if options.list_ and options.json:
        print(dumps([definition_document(each) for each in definitions], allow_nan=False))
    elif options.list_:
        rows = [(each.id, kind_text(each), each.cost, each.title) for each in definitions]
        table = Table(heads=("case", "kind", "cost", "title"), rows=rows)
        cases = Rows(title=f"{len(rows)} cases", quantities=(), tables=(table,), listed=0)
        print_rows(cases, headline=False)
    else:
        results, code_errors = _run([each.id for each in definitions], users, options)
        errors += code_errors
        if options.json:
            print(dumps([result.to_dict() for result in results], allow_nan=False))
        else:
            _print_results(results)
    for wrong in errors:
        print_error(f"ringbalance: {wrong}")
    return _BAD_INPUT if errors else _exit_code(results)


def _run(
    ids: Sequence[str], users: Mapping[str, OwnCase], options: SimpleNamespace
) -> tuple[list[CaseResult], list[CaseError]]:
    """Results in the order of the cases, and errors in the code of users' own ones."""
    results: dict[str, CaseResult] = {}
    errors: list[CaseError] = []
    scene = paper_scene() if options.scene is None else load_scene(options.scene)
    effort: dict[str, Any] = {"level": options.level, "mutations": options.mutations}
    with activity("verify", f"0 of {len(ids)} cases") as shown:

        def done(result: CaseResult) -> None:
            name = result.definition.id
            results[name] = result
            text = f"{len(results)} of {len(ids)} cases, {name} done"
            shown.show(text, done=len(results), total=len(ids))

        if packaged := [name for name in ids if name not in users]:
            run_cases(packaged, scene=scene, workers=options.workers, progress=done, **effort)
        for case in (users[name] for name in ids if name in users):
            case_scene = scene_of(case.definition, liquid_ring_scene(scene))
            try:
                done(run_definition(case.definition, case.code(), scene=case_scene, **effort))
            except CaseError as error:
                errors.append(error)
    return [results[name] for name in ids if name in results], errors


def _exit_code(results: Sequence[CaseResult]) -> int:
    """1 when a code-verification case failed or a mutation was not caught; a refuted claim is a result."""
    return int(
        any(
            result.broken
            or (result.definition.kind == "code_verification" and result.verdict is Verdict.FAILED)
            for result in results
        )
    )


def _print_judgement(document: Mapping[str, Any]) -> None:
    series = {**document["series"], "all": document["statistics"]}
    lines = [
        (
            name,
            f"{each['points']:.0f}",
            percent(each["bias"], signed=True),
            percent(each["share_within"], digits=3),
        )
        for name, each in series.items()
    ]
    middle, most = (percent(document["half_width"][key]) for key in ("median", "largest"))
    accuracy = f"known to {middle} in the median, {most} at most (95 %)"
    hints = [document["hint"]] if document["hint"] else []
    title = f"{document['title']}  {document['verdict']} ({document['source']})"
    if display().brief:
        _, points, bias, within = lines[-1]
        numbers = f"{points} points, bias {bias}, {within} within both intervals"
        text = summary_text([title, numbers, f"predictions are {accuracy}", *hints, *document["remarks"]])
        results_console().print(text, markup=False, highlight=False)
        return
    rows = Rows(
        title=title,
        quantities=(),
        facts=[
            ("rule", f"confirmed where at least {percent(document['limit'])} lie within both intervals"),
            ("predictions", accuracy),
            *(("but", hint) for hint in hints),
            *(("read", remark) for remark in document["remarks"]),
        ],
        tables=(Table(heads=("series", "points", "bias", "within"), rows=lines),),
        listed=0,
    )
    print_rows(rows, headline=False)


def _print_results(results: Sequence[CaseResult]) -> None:
    console = results_console()
    for result in results:
        if not display().brief:
            console.print(result.rows().view(headline=False), "")
        elif result.broken or result.verdict in (Verdict.FAILED, Verdict.REFUTED):
            console.print(result.brief, markup=False, highlight=False)
    counts = Counter(result.verdict for result in results)
    total = ", ".join(f"{counts[verdict]} {verdict}" for verdict in Verdict if counts[verdict])
    if broken := sum(result.broken for result in results):
        total += f"; {broken} of these proves nothing, because a mutation was not caught"
    console.print(total)
