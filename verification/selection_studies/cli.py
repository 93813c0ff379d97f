"""The command `ringbalance trade`: each model hierarchy with its front, and the models for each tolerance."""

from __future__ import annotations

import json as json_format
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ringbalance.scene import load_scene
from ringbalance.scene.narrowing import Models, liquid_ring_scene, with_tolerance
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import activity, messages_console, results_console
from ringbalance.verification.evidence import Level
from ringbalance.verification.selection_studies.choice import Choice
from ringbalance.verification.selection_studies.hierarchy import ModelHierarchy
from ringbalance.verification.selection_studies.measure import Measured, Trade
from ringbalance.verification.selection_studies.scene_numbers import scene_numbers
from ringbalance.verification.selection_studies.study import TradeStudy, tolerance_text, trade_study

_DONE: Final = 0
_FILE: Final = "trade.json"


def trade(
    scene: Path,
    *,
    json: bool = False,
    out: Path | None = None,
    level: Level = "heavy",
    save_costs: Path | None = None,
    tolerance: str | None = None,
    models: Models | None = None,
) -> int:
    """Measure speed against accuracy on a scene, and choose its models for each tolerance.

    Args:
        scene: the scene file.
        json: print one JSON document instead of tables.
        out: also write the document to trade.json in this folder.
        level: "light" leaves out the settling time, which takes whole runs of the loop.
        save_costs: also write a cost model fitted to this run's times to this file.
        tolerance: in place of the scene's, such as "0.5 %" or 0.005.
        models: "finest" takes the finest of all that is expensive, as at a tolerance of zero.

    Returns:
        Exit code 0.

    Raises:
        SceneError: a scene that cannot be used.
        OSError: a file cannot be written.
    """
    told = with_tolerance(liquid_ring_scene(load_scene(scene)), tolerance=tolerance, models=models)
    if save_costs is not None:
        check_file(save_costs)
    if out is not None:
        check_file(out / _FILE)
    with activity("trade", "model hierarchies ...") as shown:
        study = trade_study(told, level=level, progress=lambda title: shown.show(f"{title} ..."))
    text = json_format.dumps(study.document(), allow_nan=False)
    if json:
        print(text)
    else:
        results_console().print(_view(study))
    if out is not None:
        write_whole(out / _FILE, text + "\n")
        messages_console().print(f"written to {out / _FILE}", highlight=False)
    if save_costs is not None:
        write_whole(save_costs, _costs_text(study))
    return _DONE


def _costs_text(study: TradeStudy) -> str:
    """The refitted cost model as the JSON file that the program reads."""
    costs = study.refit or study.costs
    record = {
        "fitted_on": costs.fitted_on,
        "seconds": {k: float(f"{v:.3g}") for k, v in costs.seconds.items()},
    }
    return json_format.dumps(record, indent=1) + "\n"


def _view(study: TradeStudy) -> RenderableType:
    """A study for people. Returns: What rich prints."""
    parts: list[RenderableType] = [Text(study.scene.name, style="bold"), _numbers(study), Text("")]
    for trade in study.trades:
        parts += [*_trade(trade, study.choices[trade.hierarchy.quantity], study.scene.tolerance), Text("")]
    parts.append(
        Text(
            f"cost: counted work by the committed model ({study.costs.fitted_on}); * on the Pareto front",
            style="dim",
        )
    )
    return Group(*parts)


def _table(heads: str, rows: Iterable[Sequence[str | Text]], *, indent: int = 2) -> Table:
    """Columns as named, apart by "|"; those with ">" before their name stand to the right."""
    table = Table(box=None, header_style="dim", padding=(0, 1, 0, indent))
    for head in heads.split("|"):
        table.add_column(head.lstrip(">"), justify="right" if head.startswith(">") else "left")
    for row in rows:
        table.add_row(*row)
    return table


def _numbers(study: TradeStudy) -> Table:
    rows = (
        (n.name, "none" if n.value is None else f"{n.value:.3g}", Text(n.formula), n.tells)
        for n in scene_numbers(study.scene)
    )
    return _table("number|>value|formula|tells", rows, indent=1)


def _trade(trade: Trade, choices: Sequence[Choice], asked: float) -> Iterator[RenderableType]:
    hierarchy = trade.hierarchy
    yield Text(hierarchy.title, style="bold")
    if not hierarchy.status.ok:
        yield Padding(Text(hierarchy.status.text, style="yellow"), (0, 0, 0, 2))
    if not hierarchy.points:
        return
    ranked = sorted(trade.fidelities, key=lambda m: m.cost)
    yield _table("model|>error|>cost|>time|>memory", (_row(found, hierarchy) for found in ranked))
    yield Padding(Text(f"trade-off point: {trade.knee}"), (0, 0, 0, 2))
    if rows := list(map(_chosen, choices[:-1])):
        yield _table(">tolerance|models|>cost|check", rows)
    own = tolerance_text(asked, lambda tolerance: f"{tolerance:.0e}")
    yield Padding(Text(f"at {own}:", style="dim"), (0, 0, 0, 2))
    for reason in choices[-1].reasons:
        yield Padding(Text(reason), (0, 0, 0, 4))


def _row(found: Measured, hierarchy: ModelHierarchy) -> tuple[Text | str, ...]:
    top = found.fidelity.name == hierarchy.top.name
    return (
        Text(("* " if found.on_front else "  ") + found.fidelity.name, style="" if found.on_front else "dim"),
        f"known to {hierarchy.top_uncertainty:.0e}" if top else f"{found.error:.1e}",
        _seconds(found.cost),
        "" if found.seconds is None else _seconds(found.seconds),
        "" if found.memory is None else f"{found.memory / 1e6:.2g} MB",
    )


def _seconds(value: float) -> str:
    if value < 1e-3:
        return f"{value / 1e-6:.0f} µs"
    return f"{value / 1e-3:.3g} ms" if value < 1 else f"{value:.3g} s"


def _chosen(choice: Choice) -> tuple[Text | str, ...]:
    check = "nothing to check"
    if choice.reference is not None and choice.reference.name == choice.fidelity.name:
        check = "refined to the finest needed" if choice.climbed else "nothing finer needed"
    elif choice.reference is not None:
        check = f"{'refined' if choice.climbed else 'held'}, off by {choice.measured or 0.0:.0e}"
    return f"{choice.tolerance:.0e}", Text(choice.fidelity.name), _seconds(choice.cost), check
