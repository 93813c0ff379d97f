"""`ringbalance verify`: the cases on the command line, as a table or as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from json import dumps
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ringbalance.identification.data.measurements import MeasurementsError
from ringbalance.scene import load_scene
from ringbalance.scene.platform.processes import checked_workers
from ringbalance.scene.platform.terminal import Activity, activity, messages_console, results_console
from ringbalance.verification.case import CaseDefinition
from ringbalance.verification.catalogue import UnknownCaseError, load_case, load_cases
from ringbalance.verification.document import definition_document, results_document
from ringbalance.verification.evidence import Level
from ringbalance.verification.result import CaseResult, QuantityResult
from ringbalance.verification.runner import paper_scene, run_cases
from ringbalance.verification.validation.comparison import data_document
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
    *cases: str,
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
        cases: ids of the cases; none for all.
        scene: scene file; default the liquid-ring paper's disc.
        list_: name the cases and run none.
        mutations: also build in each case's mutations, which must change its verdict.
        level: "heavy" runs the cases that take long too.
        json: print one JSON document instead of a table.
        workers: processes to spread the cases over.
        data: a file of measurements (docs/measurements.md), predicted and judged instead of the cases.

    Returns:
        Exit code: 0; 1 when a code-verification case failed, or a mutation was not caught; 2 for an unknown
        case or a file of measurements that cannot be used.

    Raises:
        SceneError: the scene file is not a scene.
    """
    progress = messages_console()
    if data is not None:
        return _judge_data(data, json=json)
    try:
        definitions = [load_case(case) for case in cases] if cases else list(load_cases())
    except UnknownCaseError as error:
        progress.print(f"ringbalance: {error}", markup=False, highlight=False, soft_wrap=True)
        return BAD_INPUT
    if list_:
        _print_list(definitions, json=json)
        return DONE
    given = paper_scene() if scene is None else load_scene(scene)
    ids = [definition.id for definition in definitions]
    with activity("verify", f"0 of {len(ids)} cases") as shown:
        results = run_cases(
            ids,
            scene=given,
            level=level,
            mutations=mutations,
            workers=checked_workers(workers),
            progress=lambda result: _show_done(shown, ids, result.definition.id),
        )
    if json:
        print(dumps(results_document(results), allow_nan=False))
    else:
        _print_results(results)
    return exit_code(results)


def _judge_data(path: Path, *, json: bool) -> int:
    try:
        document = data_document(path)
    except MeasurementsError as error:
        messages_console().print(f"ringbalance: {error}", markup=False, highlight=False, soft_wrap=True)
        return BAD_INPUT
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


def _show_done(shown: Activity, ids: Sequence[str], last: str) -> None:
    done = ids.index(last) + 1
    shown.show(f"{done} of {len(ids)} cases, {last} done", done=done, total=len(ids))


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
