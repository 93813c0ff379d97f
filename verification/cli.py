"""`ringbalance verify`: the cases on the command line, as a table or as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from json import dumps
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ringbalance.scene import AnyScene, liquid_ring_scene, load_scene
from ringbalance.scene.platform.processes import checked_workers
from ringbalance.scene.platform.terminal import Activity, activity, messages_console, results_console
from ringbalance.verification.case import CaseDefinition, CaseError
from ringbalance.verification.catalogue import UnknownCaseError, load_case, place, unknown_case
from ringbalance.verification.catalogue import case_ids as case_ids_of_program
from ringbalance.verification.document import definition_document, results_document
from ringbalance.verification.evidence import Level
from ringbalance.verification.own_cases import OwnCase, own_cases
from ringbalance.verification.result import CaseResult, QuantityResult
from ringbalance.verification.runner import paper_scene, run_cases
from ringbalance.verification.verdicts import Verdict

DONE: Final = 0
FAILED: Final = 1
BAD_INPUT: Final = 2
_STYLES: Final = {
    Verdict.PASSED: "green",
    Verdict.CONFIRMED: "green",
    Verdict.CORRECTED: "yellow",
    Verdict.INCONCLUSIVE: "yellow",
    Verdict.REFUTED: "magenta",
    Verdict.FAILED: "bold red",
    Verdict.NOT_RUN: "dim",
}


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
    own, errors = own_cases(cases) if cases is not None else ([], [])
    try:
        chosen, more = _chosen(case_ids, {case.definition.id: case for case in own})
    except UnknownCaseError as error:
        # A case whose text cannot be read is unknown, too.
        for wrong in (*errors, error):
            _say(wrong)
        return BAD_INPUT
    errors += more
    if list_:
        _print_list([case.definition for case in chosen], json=json)
    else:
        given = paper_scene() if scene is None else load_scene(scene)
        results, broken = _run(
            chosen, scene=given, level=level, mutations=mutations, workers=checked_workers(workers)
        )
        errors += broken
        if json:
            print(dumps(results_document(results), allow_nan=False))
        else:
            _print_results(results)
    for wrong in errors:
        _say(wrong)
    if errors:
        return BAD_INPUT
    return DONE if list_ else exit_code(results)


def _say(error: Exception) -> None:
    messages_console().print(f"ringbalance: {error}", markup=False, highlight=False, soft_wrap=True)


@dataclass(frozen=True, kw_only=True)
class _Packaged:
    """A case of the program's, by its text."""

    definition: CaseDefinition


def _chosen(
    ids: Sequence[str], own: Mapping[str, OwnCase]
) -> tuple[list[_Packaged | OwnCase], list[CaseError]]:
    """Cases by their ids, or all, the program's first; and what is wrong with some of them."""
    known = (*case_ids_of_program(), *own)
    unknown = [name for name in ids if name not in known]
    if unknown:
        raise unknown_case(unknown[0], known)
    chosen: list[_Packaged | OwnCase] = []
    errors = []
    for name in ids or known:
        try:
            chosen.append(own[name] if name in own else _Packaged(definition=load_case(name)))
        except CaseError as error:
            errors.append(error)
    if not ids:
        chosen.sort(key=lambda case: (isinstance(case, OwnCase), place(case.definition)))
    return chosen, errors


def _run(
    chosen: Sequence[_Packaged | OwnCase], *, scene: AnyScene, level: Level, mutations: bool, workers: int
) -> tuple[list[CaseResult], list[CaseError]]:
    """The results in the order of the cases, and what is wrong with the code of own ones."""
    ids = [case.definition.id for case in chosen]
    packaged = [case.definition.id for case in chosen if isinstance(case, _Packaged)]
    results: dict[str, CaseResult] = {}
    errors: list[CaseError] = []
    with activity("verify", f"0 of {len(ids)} cases") as shown:

        def done(result: CaseResult) -> None:
            results[result.definition.id] = result
            _show_done(shown, len(ids), len(results), result.definition.id)

        if packaged:
            run_cases(packaged, scene=scene, level=level, mutations=mutations, workers=workers, progress=done)
        for case in (case for case in chosen if isinstance(case, OwnCase)):
            try:
                done(case.run(liquid_ring_scene(scene), level=level, mutations=mutations))
            except CaseError as error:
                errors.append(error)
    return [results[name] for name in ids if name in results], errors


def _judge_data(path: Path, *, json: bool) -> int:
    # What predicts every kind of measurement loads a compiler.
    from ringbalance.verification.validation.comparison import data_document  # noqa: PLC0415

    document = data_document(path)
    if json:
        print(dumps(document, allow_nan=False))
        return DONE
    console, verdict = results_console(), Verdict(document["verdict"])
    heading = Text.assemble(
        (document["title"], "bold"), "  ", Text(verdict, style=_STYLES[verdict]), f"  ({document['source']})"
    )
    console.print(heading, soft_wrap=True)
    table = Table(box=None, header_style="dim", padding=(0, 1, 0, 2))
    for header in ("series", "points", "bias", "within"):
        table.add_column(header, justify="left" if header == "series" else "right")
    for name, one in {**document["series"], "all": document["statistics"]}.items():
        table.add_row(name, f"{one['points']:.0f}", f"{one['bias']:+.1%}", f"{one['share_within']:.0%}")
    console.print(table)
    console.print(_indented(f"Confirmed where at least {document['limit']:.0%} lie within both intervals."))
    return DONE


def exit_code(results: Sequence[CaseResult]) -> int:
    """1 when a code-verification case failed or a mutation was not caught; a refuted claim is a result."""
    failed = any(
        result.broken or (result.definition.kind == "code_verification" and result.verdict is Verdict.FAILED)
        for result in results
    )
    return FAILED if failed else DONE


def _show_done(shown: Activity, total: int, done: int, last: str) -> None:
    shown.show(f"{done} of {total} cases, {last} done", done=done, total=total)


def _print_list(definitions: Sequence[CaseDefinition], *, json: bool) -> None:
    if json:
        print(dumps([definition_document(d) for d in definitions], allow_nan=False))
        return
    table = Table(box=None, header_style="dim", padding=(0, 1))
    table.add_column("case", no_wrap=True)
    for header in ("kind", "cost", "title"):
        table.add_column(header)
    for d in definitions:
        table.add_row(d.id, d.kind.replace("_", " ") + _numbered(d), d.cost, d.title)
    results_console().print(table)


def _numbered(definition: CaseDefinition) -> str:
    return "" if definition.number is None else f" {definition.number}"


def _print_results(results: Sequence[CaseResult]) -> None:
    console = results_console()
    for result in results:
        _print_case(console, result)
    counts = Counter(result.verdict for result in results)
    words = [
        Text(f"{counts[verdict]} {verdict}", style=_STYLES[verdict]) for verdict in Verdict if counts[verdict]
    ]
    console.print(Text(", ").join(words))


def _print_case(console: Console, result: CaseResult) -> None:
    definition = result.definition
    kind = definition.kind.replace("_", " ") + _numbered(definition)
    heading = Text.assemble((definition.id, "bold"), (f"  {kind}  ", "dim"), _styled(result))
    console.print(heading, soft_wrap=True)
    console.print(_indented(definition.claim))
    if result.evidence is None:
        console.print(_indented(result.status, style="dim"), "")
        return
    table = Table(box=None, header_style="dim", padding=(0, 1, 0, 2))
    for header in ("quantity", "found", "reference or limit", "±", "verdict"):
        table.add_column(header, justify="left" if header in ("quantity", "verdict") else "right")
    for quantity in result.quantities:
        table.add_row(*_quantity_row(quantity))
    console.print(table)
    for remark in _remarks(result):
        console.print(remark)
    console.print()


def _styled(result: CaseResult) -> Text:
    if result.broken:
        return Text(f"{result.verdict}, BROKEN: a defect was not caught", style="bold red")
    return Text(result.verdict, style=_STYLES[result.verdict])


def _quantity_row(result: QuantityResult) -> tuple[str | Text, ...]:
    quantity, found = result.quantity, result.found
    verdict = Text(result.verdict, style=_STYLES[result.verdict])
    title = Text(quantity.title if quantity.unit == "1" else f"{quantity.title} [{quantity.unit}]")
    if found is None:
        return title, "", "", "", verdict
    bound = {"at_most": f"≤ {quantity.limit:.4g}", "at_least": f"≥ {quantity.limit:.4g}"}
    reference = "" if result.reference is None else f"{result.reference.value:.6g}"
    half_width = result.half_width
    shown = f"{half_width:.2g}" if half_width else ""
    return title, f"{found.value:.6g}", bound.get(quantity.metric, reference), shown, verdict


def _remarks(result: CaseResult) -> Iterator[Padding]:
    definition = result.definition
    if definition.kind == "claim":
        yield _indented(result.filled(definition.consequence_of(result.verdict)), style="italic")
    for mutation in result.mutations:
        word = "caught" if mutation.caught else f"NOT CAUGHT (must come out {mutation.expect})"
        text = f"with a defect, {mutation.what}: {mutation.verdict}, {word}"
        yield _indented(text, style="green" if mutation.caught else "bold red")


def _indented(text: str, *, style: str = "") -> Padding:
    return Padding(Text(text, style=style), (0, 0, 0, 2))
