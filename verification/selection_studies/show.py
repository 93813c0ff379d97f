"""A trade study on the terminal: each model hierarchy with its front, and the models for each tolerance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ringbalance.verification.selection_studies.choice import Choice
from ringbalance.verification.selection_studies.measure import Measured, Trade
from ringbalance.verification.selection_studies.scene_numbers import scene_numbers
from ringbalance.verification.selection_studies.study import TradeStudy, tolerance_text

_MICRO, _MILLI = 1e-6, 1e-3


def trade_view(study: TradeStudy) -> RenderableType:
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
