"""The loop and its tuning: runs under each law and gain, how likely each settles, what a wrong k costs."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from ringbalance.reports.figure import (
    AMPLITUDE,
    AS_PAPER,
    FOUND,
    INK,
    MUTED,
    PAPER,
    REGIME_COLOURS,
    SURFACE,
    TIME,
    Curve,
    Drawing,
    amplitudes,
    curve,
    draw,
    level,
    logarithmic,
    nice_span,
    panels,
    plain_number,
)
from ringbalance.reports.pages.consequences import find_consequences
from ringbalance.reports.pages.first_page import RETUNED, place_of_run
from ringbalance.reports.ring_figures import ring_frames, run_with_injections
from ringbalance.reports.run_figures import early_time, fill_ratios, residual_polar
from ringbalance.reports.section import Record, Section, Work
from ringbalance.reports.summary import is_papers, runs_settled, tuning_of
from ringbalance.results.numbers import percent

_GAINS: Final = {1: "with the scene’s gain", 2: "with the recommended settings"}
"""Titles of the calibrated law's ensembles, by their place in the evidence."""
_LAWS: Final[dict[str, dict[str, Any]]] = {
    "calibrated": {"color": FOUND, "label": "the calibrated law"},
    "paper": {**AS_PAPER, "label": "the paper’s law"},
}
_BINS: Final = 16
_MEMBERS: Final = MappingProxyType({"light": 500, "heavy": 20_000})
"""Runs of each ensemble, by level: at 500 a probability is known to about four per cent."""


def _reach(work: Work) -> Record:
    """What a pair cancels at the most, as a vibration; where the first pair's lies, by the sensor's phase."""
    scene, moment = work.scene, work.calibration.residual.usable_pair_moment
    return {
        "pairs": scene.disc.chambers // 2,
        "vibration_m": moment * scene.rotor.influence_coefficient,
        "direction_rad": -scene.rotor.lag_angle,
        "time_limit_s": scene.run.time_limit,
    }


def _loop(own: Record, evidence: Record) -> Record:
    runs, limit = _drawn_runs(evidence), evidence["limit_m"]
    run, tuning = runs.get("calibrated"), tuning_of(evidence)
    disc = (evidence.get("operation") or {}).get("disc")
    samples = _samples(evidence) if own else []
    return {
        "retuned": place_of_run(evidence, RETUNED),
        "runs_settled": runs_settled(tuning) if tuning.get("fraction_settled") is not None else "",
        "amplitude": run_with_injections(runs, _LAWS, limit) if runs else None,
        "rings": ring_frames(run, disc) if run and disc else None,
        "laws": list(runs),
        "polar": residual_polar(run, own) if run and own else None,
        "settling": _settling_histogram(samples) if samples else None,
        "samples": samples,
    }


def _samples(evidence: Record) -> list[Record]:
    ensembles = (evidence.get("consequences") or {}).get("ensembles", [])
    return [
        {
            "title": title,
            "edges_s": ensembles[place]["settling_time_s"]["edges"],
            "counts": ensembles[place]["settling_time_s"]["counts"],
            "runs": ensembles[place]["members"],
            "not_settled": ensembles[place]["probability"]["not_settled"]["value"],
            "place": place,
        }
        for place, title in _GAINS.items()
        if place < len(ensembles)
    ]


def _drawn_runs(evidence: Record) -> dict[str, Record]:
    """By law, the calibrated one first; the paper's law is compared on the paper's own disc alone."""
    runs = evidence["closed_loop"]
    return {law: runs[law] for law in _LAWS if law in runs and (law != "paper" or is_papers(evidence))}


def _settling_histogram(samples: list[Record]) -> Drawing:
    """Settling times of samples of runs, a panel each, with those that never settle as a bar of their own."""
    side = 1 / len(samples)

    def paint(axes: Axes) -> None:
        drawn = panels(
            axes, *((place * side + 0.085, 0.2, side - 0.105, 0.62) for place in range(len(samples)))
        )
        for panel, sample in zip(drawn, samples, strict=True):
            _histogram(panel, sample)
        drawn[0].set_ylabel("share of all runs in %")

    return draw("settling-histogram", paint, columns=0, wide=True)


def _histogram(panel: Axes, sample: Record) -> None:
    edges, counts = np.asarray(sample["edges_s"], dtype=float), np.asarray(sample["counts"], dtype=float)
    starts = np.arange(0, counts.size, max(-(-counts.size // _BINS), 1))
    shares = 100 * np.add.reduceat(counts, starts) / sample["runs"]
    ends = edges[np.append(starts, counts.size)]
    panel.bar(ends[:-1], shares, width=np.diff(ends), align="edge", color=FOUND, edgecolor=SURFACE)
    span = float(ends[-1] - ends[0])
    place, width, never = ends[-1] + 0.14 * span, 0.1 * span, 100 * sample["not_settled"]
    panel.bar(place, never, width=width, color=SURFACE, edgecolor=PAPER, hatch="////", linewidth=1)
    panel.text(place, never + 1.5, percent(sample["not_settled"]), ha="center", color=PAPER)
    ticks = [tick for tick in nice_span(float(ends[-1])) if ends[0] <= tick <= ends[-1] - 0.05 * span]
    panel.set_xticks([*ticks, place], [*(plain_number(tick) for tick in ticks), "never"])
    panel.set_title(sample["title"], loc="left", fontsize="medium", color=INK)
    panel.set(xlabel="settling time in s", xlim=(ends[0], place + width), ylim=(0, 112))


LOOP: Final = Section(
    name="loop", title="Loop and tuning", place="report", collect=_reach, show=_loop, always=True
)


def _injections(_own: Record, evidence: Record) -> Record:
    runs = evidence["closed_loop"]
    if not (run := runs.get("calibrated")):
        return {"early": None}
    until = early_time(next(iter(runs.values())))
    return {
        "early": _early_amplitude(runs, evidence["limit_m"], until),
        "fills": fill_ratios(run, until),
        "regimes": _regimes(run) if run["injections"] else None,
    }


def _early_amplitude(runs: Mapping[str, Record], limit: float, until: float) -> Drawing:
    """Vibration amplitude within the first operations, m, liquid flowing, under the laws that were run."""

    def of(run: Record, look: dict[str, Any]) -> Curve:
        early = np.asarray(run["time_s"]) <= until
        time, values = (np.asarray(run[key])[early] for key in ("time_s", "amplitude_m"))
        return time, values, {**look, "linewidth": 1.3}

    return draw(
        "amplitude-early",
        amplitudes([of(runs[name], look) for name, look in _LAWS.items() if name in runs], limit),
        x=TIME,
        y=AMPLITUDE,
        xlim=(0, until),
        columns=3,
    )


def _regimes(run: Record) -> Drawing:
    """The regime of the tube in every gas operation of a run, by chamber and time."""
    operations, letters = run["injections"], list(run["fill_ratio"])
    last = max(item["time_s"] + item["duration_s"] for item in operations)
    least = 0.006 * last
    named: set[str] = set()

    def bar(axes: Axes, item: Record, regime: str, share: tuple[float, float]) -> None:
        width = max(item["duration_s"], least)
        axes.barh(
            letters.index(item["chamber"]),
            width * (share[1] - share[0]),
            left=item["time_s"] + width * share[0],
            height=0.55,
            color=REGIME_COLOURS[regime],
            linewidth=0,
            label=None if regime in named else regime,
        )
        named.add(regime)

    def paint(axes: Axes) -> None:
        for item in operations:
            start, end = item["regime"], item.get("regime_end") or item["regime"]
            parts = [(start, (0.0, 1.0))] if end == start else [(start, (0.0, 0.5)), (end, (0.5, 1.0))]
            for regime, share in parts:
                bar(axes, item, regime, share)
        axes.set_yticks(range(len(letters)), letters)

    return draw(
        "loop-regimes",
        paint,
        x=TIME,
        y=("gas into chamber", "1"),
        xlim=(0, 1.02 * (last + least)),
        ylim=(len(letters) - 0.5, -0.5),
        columns=4,
        wide=True,
        height=1.5 + 0.2 * len(letters),
    )


INJECTIONS: Final = Section(
    name="injections", title="The closed loop, injection by injection", show=_injections
)


def _find(work: Work) -> Record:
    tuned = work.tuning.scene if work.tuning.gain else None
    model, members = work.calibration.model, _MEMBERS[work.level]
    return find_consequences(work.scene, model, recommended=tuned, members=members).document()


def _consequences(found: Record, _evidence: Record) -> Record:
    return {"figure": _gain_margin(found["gain"][-1]) if found["gain"] else None}


def _gain_margin(gain: Record) -> Drawing:
    """Gains at which the loop starts to overshoot and to be unstable, over the tube's drag coefficient.

    Args: `gain`: one law's entry of `gain`, SI.
    """
    over, scene = gain["over_drag_coefficient"], gain["proportional_s_per_m"]
    k, overshoot, unstable = (over[key] for key in ("values", "overshoot_gain", "instability_gain"))
    low, high = 0.8 * min(*overshoot, *unstable, scene), 1.25 * max(*overshoot, *unstable, scene)
    return draw(
        "gain-margin",
        curve(k, overshoot, "overshoot from", color=FOUND),
        curve(k, unstable, "unstable from", color=PAPER),
        level(scene, "Kc in the scene", color=MUTED, linewidth=1, linestyle=":"),
        curve(
            [gain["drag_coefficient"]],
            [scene],
            "this machine",
            color=INK,
            linestyle="",
            marker="D",
            markersize=5,
        ),
        logarithmic("x", within=(k[0], k[-1])),
        logarithmic("y", within=(low, high)),
        x=("loss coefficient k at equal fills", "1"),
        y=("Kc", "s/m"),
        ylim=(low, high),
        columns=4,
        wide=True,
        height=3.4,
    )


CONSEQUENCES: Final = Section(
    name="consequences", title="What a wrong k costs", collect=_find, show=_consequences
)
