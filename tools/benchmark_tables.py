"""Tables of speed and accuracy in the documents, from the kept benchmark of sweeps."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from ringbalance.results.numbers import percent

ROOT: Final = Path(__file__).resolve().parents[1]
KEPT: Final = ROOT / "benchmarks" / "sweep.json"


def kept_rates() -> dict[str, Any]:
    """Stored result of `python benchmarks/sweep.py --keep`."""
    record: dict[str, Any] = json.loads(KEPT.read_text(encoding="utf-8"))
    return record


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def models_table(record: Mapping[str, Any]) -> str:
    """Error and rate of each model."""
    rows = [
        (
            each["quantity"],
            each["model"],
            f"known to {each['uncertainty']:.0e}" if each["uncertainty"] else f"{each['error']:.0e}",
            _rounded(each["designs_per_second"]),
        )
        for each in record["models"]
    ]
    return markdown(("quantity", "model", "error", "designs a second"), rows)


def levels_table(record: Mapping[str, Any]) -> str:
    """Rate and error of each level of a sweep."""
    rows_err, uncertainty = (
        f"{record['velocity']['error']:.0e}" if record["velocity"]["error"] else "0",
        percent(record["velocity"]["uncertainty"], digits=1),
    )
    levels = (
        ("static", "`sweep --no-intervals`: the array core", rows_err, uncertainty),
        ("intervals", "`sweep`: the same with both sides of every uncertain input", rows_err, uncertainty),
        ("calibrate", "`calibrate`: one by one, with every uncertainty", "–", uncertainty),
        (
            "runs",
            f"`sweep --runs {record['runs']}`: drawn devices in closed loop",
            "of the fraction: its bounds",
            "drawn",
        ),
    )
    heads = ("level", "designs a second", "rows err by (velocity)", "the models themselves")
    rows = [(text, _rounded(1 / record["seconds"][name]), *errors) for name, text, *errors in levels]
    when = (
        f"Of {record['designs']} designs about the paper's disc, {record['checked']} of them calibrated, in "
        f"processor time (`python benchmarks/sweep.py --keep`, {record['date']}):"
    )
    spent = record["seconds"]
    loops = (
        f"In the same run a loop over `calibrate` took {spent['calibrate'] / spent['static']:.0f} times as "
        f"long as the array core, and one over `simulate`, {record['devices']:.2g} runs a design, "
        f"{record['loop_of_simulations']:.2g} times as long as `--runs`, where each device has its own law."
    )
    return f"{when}\n\n{markdown(heads, rows)}\n\n{loops}"


def workers_table(record: Mapping[str, Any]) -> str:
    """Fraction of the time of many workers spent on designs, and the time of sending a bundle."""
    each, call = record["seconds"]["runs"], record["seconds"]["call"]
    rows = [
        (str(row["workers"]), *(percent(used, digits=2) for used in row["used"])) for row in record["workers"]
    ]
    cost = (
        f"The calling process sends and takes every bundle, some {1e3 * call:.0f} ms each, so a bundle must "
        f"be as long as all workers take to be served: {1000 * call:.0f} s for a thousand. "
        f"`python benchmarks/sweep.py` simulates that on paper, with designs of {each:.2g} s (up to "
        f"{record['runs']} devices each). The share of the workers' time that is used:"
    )
    return f"{cost}\n\n{markdown(('workers', *(f'{count} designs' for count in record['on_paper'])), rows)}"


def _rounded(rate: float) -> str:
    """A rate with one digit, since a busy machine may halve it."""
    return f"{float(f'{rate:.1g}'):.0f}"
