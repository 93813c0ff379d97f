"""What a wrong k costs the machine, as tables of text, from the evidence's `consequences`."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from ringbalance.reports.section import Record, Section, Table, Work
from ringbalance.reports.studies.consequences import find_consequences
from ringbalance.results.numbers import MISSING, number, percent, short, shown

_MEMBERS: Final = MappingProxyType({"light": 500, "heavy": 20_000})
"""Runs of each ensemble, by level: at 500 a probability is known to about four per cent."""
_COLUMNS: Final = ("the paper’s law", "the calibrated law", "the calibrated law, recommended settings")
_CHANCES: Final = (
    ("not_settled", "not settled by the time limit"),
    ("overshoot", "overshoots"),
    ("misadjustment", "raises the vibration"),
)


def _collect(work: Work) -> Record:
    members = _MEMBERS[work.level]
    tuned = work.tuning.scene if work.tuning.gain else None
    return find_consequences(
        work.scene, work.calibration.model, recommended=tuned, members=members
    ).document()


def _view(found: Record, _evidence: Record) -> Record:
    return {
        "findings": found["findings"][:3],
        "notes": found["notes"],
        "gains": _gain_table(found["gain"]),
        "runs": _run_table(found["runs"]),
        "chances": _chance_table(found["ensembles"]),
    }


def _gain_table(gains: list[Record]) -> Table:
    rows = (
        (
            "k at equal fills, as Eq. 18 reads the velocity",
            [number(g["drag_coefficient"], digits=3) for g in gains],
        ),
        ("velocity at equal fills", [shown(g["velocity_m_s"], "m/s", digits=3) for g in gains]),
        ("λ per transferred mass", [shown(g["moment_per_transferred_mass_m"], "m", digits=3) for g in gains]),
        (
            "amplitude taken away per second of gas",
            [shown(g["slope_m_per_s"], "m", digits=3) for g in gains],
        ),
        ("share that one operation takes away", [percent(g["gain_per_operation"], digits=3) for g in gains]),
        ("Kc in the scene", [_gain(g["proportional_s_per_m"]) for g in gains]),
        ("overshoot from Kc", [_gain(g["overshoot_proportional_s_per_m"]) for g in gains]),
        ("unstable from Kc", [_gain(g["instability_proportional_s_per_m"]) for g in gains]),
    )
    heads = [f"the {g['law']} law".replace("the paper law", "the paper’s law") for g in gains]
    return Table(
        caption="The loop’s gain under both laws. An operation that takes away more than the whole residual "
        "overshoots; more than twice, and the residual grows.",
        heads=("", *heads),
        rows=[(label, *cells) for label, cells in rows],
    )


def _gain(value: float | None) -> str:
    return shown(value, "s/m", digits=3)


def _run_table(runs: list[Record]) -> Table:
    rows = [
        (
            run["title"],
            MISSING if run["proportional_s_per_m"] is None else _gain(run["proportional_s_per_m"]),
            shown(run["settling_time_s"], "s", digits=3) if run["settled"] else run["verdict"],
            *(short(run[key]) for key in ("injections", "overshoots", "misadjustments")),
        )
        for run in runs
    ]
    return Table(
        caption="One run each, with the scene’s noise. The law-based controller computes its valve-open "
        "times from a law and needs no gain.",
        heads=("Run", "Kc", "Within the limit from", "Injections", "Overshoots", "Misadjustments"),
        rows=rows,
        style="",
    )


def _chance_table(ensembles: list[Record]) -> Table:
    chances = [
        (label, *(_chance(ensemble["probability"][key]) for ensemble in ensembles)) for key, label in _CHANCES
    ]
    times = (_times(ensemble["settling_time_s"]["quantiles"]) for ensemble in ensembles)
    members = short(ensembles[0]["members"]) if ensembles else ""
    return Table(
        caption="Probabilities over the uncertainty of k, λ, influence coefficient, lag angle and noise: "
        f"{members} runs each under the flow law alone; 95 % intervals in brackets.",
        heads=("", *_COLUMNS[: len(ensembles)]),
        rows=[*chances, ("half of all runs settled by (5 %; 95 %)", *times)],
        style="",
    )


def _chance(share: Record) -> str:
    return f"{percent(share['value'])} ({percent(share['low'])} to {percent(share['high'])})"


def _times(quantiles: Record | None) -> str:
    if not quantiles or quantiles.get("0.5") is None:
        return MISSING if quantiles is None else "not reached"
    low, middle, high = (
        "not reached" if quantiles[key] is None else shown(quantiles[key], "s", digits=3)
        for key in ("0.05", "0.5", "0.95")
    )
    return f"{middle} ({low}; {high})"


SECTION: Final = Section(
    name="consequences",
    title="What a wrong k costs",
    collect=_collect,
    show=_view,
)
