"""The command `ringbalance trade`: each model hierarchy with its front, and the models for each tolerance."""

from __future__ import annotations

import json as json_format
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ringbalance.scene import load_scene
from ringbalance.scene.accuracy import Models, with_tolerance
from ringbalance.scene.narrowing import liquid_ring_scene
from ringbalance.scene.platform.files import check_file, write_whole
from ringbalance.scene.platform.terminal import activity, messages_console, results_console
from ringbalance.verification.evidence import Level
from ringbalance.verification.selection_studies.choice import Choice
from ringbalance.verification.selection_studies.measure import Measured, Trade
from ringbalance.verification.selection_studies.scene_numbers import scene_numbers
from ringbalance.verification.selection_studies.study import TradeStudy, tolerance_text, trade_study

DONE: Final = 0
FILE: Final = "trade.json"
_MICRO, _MILLI = 1e-6, 1e-3


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
        models: "finest" models every term that has a model, whatever the tolerance.

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
        check_file(out / FILE)
    with activity("trade", "model hierarchies ...") as shown:
        study = trade_study(told, level=level, progress=lambda title: shown.show(f"{title} ..."))
    text = json_format.dumps(study.document(), allow_nan=False)
    if json:
        print(text)
    else:
        results_console().print(_view(study))
    if out is not None:
        write_whole(out / FILE, text + "\n")
        messages_console().print(f"written to {out / FILE}", highlight=False)
    if save_costs is not None:
        write_whole(save_costs, _costs_text(study))
    return DONE


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


def _numbers(study: TradeStudy) -> Table:
    table = Table(box=None, header_style="dim", padding=(0, 1))
    for header in ("number", "value", "formula", "tells"):
        table.add_column(header, justify="right" if header == "value" else "left")
    for n in scene_numbers(study.scene):
        table.add_row(n.name, "none" if n.value is None else f"{n.value:.3g}", Text(n.formula), n.tells)
    return table


def _trade(trade: Trade, choices: Sequence[Choice], asked: float) -> Iterator[RenderableType]:
    hierarchy = trade.hierarchy
    yield Text(hierarchy.title, style="bold")
    if not hierarchy.status.ok:
        yield Padding(Text(hierarchy.status.text, style="yellow"), (0, 0, 0, 2))
    if not hierarchy.points:
        return
    yield _fidelities(trade)
    yield Padding(Text(f"trade-off point: {trade.knee}"), (0, 0, 0, 2))
    yield _chosen(choices)
    own = tolerance_text(asked, lambda tolerance: f"{tolerance:.0e}")
    yield Padding(Text(f"at {own}:", style="dim"), (0, 0, 0, 2))
    for reason in choices[-1].reasons:
        yield Padding(Text(reason), (0, 0, 0, 4))


def _fidelities(trade: Trade) -> Table:
    table = Table(box=None, header_style="dim", padding=(0, 1, 0, 2))
    table.add_column("model")
    for header in ("error", "cost", "time", "memory"):
        table.add_column(header, justify="right")
    for found in sorted(trade.fidelities, key=lambda m: m.cost):
        table.add_row(
            *_row(
                found,
                top=found.fidelity.name == trade.hierarchy.top.name,
                width=trade.hierarchy.top_uncertainty,
            )
        )
    return table


def _row(found: Measured, *, top: bool, width: float) -> tuple[Text | str, ...]:
    mark = "* " if found.on_front else "  "
    return (
        Text(mark + found.fidelity.name, style="" if found.on_front else "dim"),
        f"known to {width:.0e}" if top else f"{found.error:.1e}",
        _seconds(found.cost),
        "" if found.seconds is None else _seconds(found.seconds),
        "" if found.memory is None else f"{found.memory / 1e6:.2g} MB",
    )


def _seconds(value: float) -> str:
    if value < _MILLI:
        return f"{value / _MICRO:.0f} µs"
    return f"{value / _MILLI:.3g} ms" if value < 1 else f"{value:.3g} s"


def _chosen(choices: Sequence[Choice]) -> Table:
    table = Table(box=None, header_style="dim", padding=(0, 1, 0, 2))
    table.add_column("tolerance", justify="right")
    table.add_column("models")
    table.add_column("cost", justify="right")
    table.add_column("check")
    for choice in choices[:-1]:
        table.add_row(
            f"{choice.tolerance:.0e}", Text(choice.fidelity.name), _seconds(choice.cost), _check(choice)
        )
    return table


def _check(choice: Choice) -> str:
    if choice.reference is None:
        return "nothing to check"
    word = "refined" if choice.climbed else "held"
    return f"{word}, {choice.measured or 0.0:.0e} left out"
