"""What `tune` answers with: settings chosen by runs of few drawn devices, judged on others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from ringbalance.controller.balancer import FURTHER, Demand, Settings
from ringbalance.controller.judging.judge import Judgement
from ringbalance.controller.judging.ranking import Ranking
from ringbalance.controller.judging.remedies import Remedied, amplitude_reached
from ringbalance.controller.judging.search import Along
from ringbalance.controller.rotor import assumed_rotor
from ringbalance.controller.trials import Information
from ringbalance.results.numbers import given, percent
from ringbalance.results.requirements import MET, MISSED, OPEN
from ringbalance.results.result import Cells, Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import finite
from ringbalance.scene.changes import rechecked
from ringbalance.scene.describe import setting_text
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.origins import SceneFile, raw_value_at, with_values_at

LONGER: Final = 300.0
"""s, for which devices under the recommended settings are watched once more."""
_CODES: Final = {MET: "tuned_met", MISSED: "tuned_missed", OPEN: "tuned_open"}
_EXACT: Final = "_exact"
"""After the code of a verdict that is met by devices of which the scene states no uncertainty."""
_SETTLED: Final = "settled"
_MOST_CAUSES: Final = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class BestOfKind:
    """The best settings of one kind of controller, on the devices of the search."""

    kind: str
    judgement: Judgement


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class Tuning(Result):
    """Settings for a scene's controller, and the fraction of drawn devices that they serve.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> tuning = rb.tune(scene)
        >>> tuning.recommended.verdict
        'met'
    """

    given: SceneFile
    """The scene as it was."""
    recommended: Judgement
    own: Judgement | None
    """Of the scene's own settings on the same devices; None: it gives none."""
    longer: Judgement | None
    """Of the recommended ones, devices watched for `LONGER`; None: all are watched to the end of the run."""
    tried: tuple[BestOfKind, ...]
    along: tuple[Along, ...] = ()
    """The best at every level of the axis that the balancer names, such as the gas pressure."""
    along_name: str = ""
    """Path of its key."""
    along_unit: str = "1"
    information: Information = field(default_factory=Information)
    remedies: tuple[Remedied, ...] = ()
    """What remedies come to, the best first; tried where what is required is not met."""
    capacity: tuple[Finding, ...] = ()
    """What a machine moves beyond the capacity that decides a verdict."""
    ranking: Ranking = field(default_factory=Ranking)
    """Which input decides what the recommended settings come to."""
    choices: tuple[Remedied, ...] = ()
    """What things that can be bought make of a scene that leaves them open."""
    open_choice: bool = False
    """Whether it does."""

    @property
    def scene(self) -> Any:
        """The scene with what is recommended, of the type that it was."""
        return with_values_at(self.given, self.recommended.settings)

    @property
    def recommended_scene(self) -> AnyScene:
        """The same, checked, with a hash of its own."""
        return rechecked(self.scene)

    @property
    def succeeded(self) -> bool:
        """Whether what the scene requires is met with the recommended settings."""
        return self.recommended.verdict == MET

    @property
    def status(self) -> str:
        """The first sentences."""
        return " ".join(each.text for each in self.rows().findings[:2])

    def rows(self) -> Rows:
        """What is recommended, its verdict, and what it rests on."""
        return _rows(self)

    def to_dict(self) -> dict[str, Any]:
        """As a JSON document in SI."""
        return _document(self)


def _rows(tuning: Tuning) -> Rows:
    scene = tuning.given
    return Rows(
        title=f"Tuning of {scene.name} ({scene.source})",
        quantities=(*_fractions(tuning), *tuning.information.quantities),
        findings=tuple(_findings(tuning)),
        facts=tuning.information.facts,
        tables=(
            _settings_table(tuning),
            required_table(tuning.recommended),
            _along_table(tuning),
            _tried_table(tuning),
            _remedies_table("Remedies, each with its best settings", tuning.remedies),
            _remedies_table(
                "Valves that can be bought, their lags assumed, each with the best settings of a coarse grid",
                tuning.choices,
            ),
        ),
    )


def _document(tuning: Tuning) -> dict[str, Any]:
    scene = tuning.given
    return {
        "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
        "balancer": scene.balancer,
        "status": tuning.status,
        "asked": tuning.recommended.asked,
        **judgement_document(tuning.recommended),
        "settings": plain_settings(tuning.recommended.settings),
        "own": None if tuning.own is None else judgement_document(tuning.own),
        "further_s": FURTHER,
        "longer": None
        if tuning.longer is None
        else {"further_s": LONGER, "fraction": tuning.longer.fraction.document()},
        "required": required_document(tuning.recommended),
        "along": {
            "path": tuning.along_name,
            "unit": tuning.along_unit,
            "levels": [_level(each) for each in tuning.along],
        },
        "tried": [
            {
                "kind": each.kind,
                "settings": plain_settings(each.judgement.settings),
                "fraction": each.judgement.fraction.document(),
            }
            for each in tuning.tried
        ],
        "remedies": [each.document() for each in tuning.remedies],
        "valves": [each.document() for each in tuning.choices],
        "ranking": tuning.ranking.document(),
        "clipped": dict(tuning.recommended.outcomes.clipped),
        **tuning.information.document,
        **tuning.rows().document(),
    }


def required_document(judgement: Judgement) -> list[dict[str, Any]]:
    """What is asked of every device, and the fraction that meets it; SI."""
    return [
        {
            "code": each.code,
            "sense": each.sense,
            "required": each.required,
            "unit": each.unit,
            "stated": each.stated,
            "amplitude_m": each.amplitude,
            "fraction": judgement.fraction_of(each).document(),
        }
        for each in judgement.demands
    ]


def judgement_document(judgement: Judgement) -> dict[str, Any]:
    """Verdict, fraction and times of settings; SI."""
    return {
        "verdict": judgement.verdict,
        "fraction": judgement.fraction.document(),
        "settling_time_s": times_of(judgement),
        "ended": dict(Counter(judgement.outcomes.ended)),
    }


def _level(level: Along) -> dict[str, Any]:
    low, middle, high = level.usable_moment
    return {
        "value": level.level,
        "settings": plain_settings(level.judgement.settings),
        "fraction": level.judgement.fraction.document(),
        "verdict": level.judgement.verdict,
        "settling_time_s": times_of(level.judgement),
        "usable_moment_kg_m": {"p10": finite(low), "p50": finite(middle), "p90": finite(high)},
    }


def times_of(judgement: Judgement) -> dict[str, float | None]:
    """When half and nine tenths of all devices have settled, s; None where the bound is open."""
    times = {name: judgement.settling_time(part) for name, part in (("p50", 0.5), ("p90", 0.9))}
    return {name: None if time is None else finite(time[0]) for name, time in times.items()}


def plain_settings(settings: Settings) -> dict[str, Any]:
    """For JSON."""
    return {path: list(value) if isinstance(value, tuple) else value for path, value in settings.items()}


def _fractions(tuning: Tuning) -> Iterator[Quantity]:
    for key, name, judgement in (
        ("fraction_met", "devices that meet what is required", tuning.recommended),
        ("fraction_met_own", "the same with the scene's own settings", tuning.own),
        ("fraction_met_longer", "the same, watched longer", tuning.longer),
    ):
        if judgement is not None:
            share = judgement.fraction
            yield Quantity(
                key=key, name=name, value=share.value, lower=share.low, upper=share.high, origin="simulated"
            )
    for key, time in times_of(tuning.recommended).items():
        name = {"p50": "half of them settle within", "p90": "nine tenths settle within"}[key]
        yield Quantity(
            key=f"settling_time_{key}",
            name=name,
            unit="s",
            value=time,
            origin="simulated",
            status="ok" if time is not None else "not_reached",
            digits=3,
        )


def _findings(tuning: Tuning) -> Iterator[Finding]:
    best = tuning.recommended
    changes = {
        path: value[0] if isinstance(value, tuple) else value
        for path, value in best.settings.items()
        if value is not None
    }
    yield Finding(
        code=_CODES[best.verdict] + if_exact(tuning.given, best), values=share_values(best), change=changes
    )
    times = times_of(best)
    if times["p50"] is not None:
        code = "tuned_half" if times["p90"] is None else "tuned_times"
        yield Finding(code=code, values={"half": times["p50"], "most": times["p90"]})
    if tuning.own is None:
        yield Finding(code="tuned_own_none")
    elif not best.settings:
        yield Finding(code="tuned_own_best")
    else:
        yield Finding(code="tuned_own", values={**share_values(tuning.own), "verdict": tuning.own.verdict})
    if tuning.longer is not None:
        values = {**share_values(tuning.longer), "time": LONGER, "first": FURTHER}
        yield Finding(code="tuned_longer", values=values)
    if best.verdict != MET and (causes := causes_of(best)):
        yield Finding(code="tuned_causes", values={"causes": causes})
    yield from tuning.capacity
    if not tuning.remedies and tuning.along and best.verdict != MET:
        yield Finding(code="tuned_no_level", values={"key": tuning.along_name})
    yield from assumed_rotor(tuning.scene)
    yield from _mending(tuning)


def _mending(tuning: Tuning) -> Iterator[Finding]:
    """The best remedy, what to measure, and what the answer leaves open."""
    best, clipped = tuning.recommended, tuning.recommended.outcomes.clipped
    meeting = [each for each in tuning.remedies if each.met]
    for each in (meeting or tuning.remedies)[:1]:
        code = "remedy_meets" if each.met else "remedy_best"
        values = {**share_values(each.judgement), "what": _changes_text(each.changes, ", ")}
        yield Finding(code=code, values=values, change=each.changes)
    if best.verdict != MET:
        yield from tuning.ranking.findings()
    states = any(each.stated and each.outcome == "final_amplitude" for each in best.demands)
    if best.verdict != MET and states and (reached := amplitude_reached(best)) is not None:
        yield Finding(code="amplitude_reached", values={"amplitude": reached, "asked": best.asked})
    if tuning.open_choice:
        yield Finding(code="ideal_valve")
    if clipped:
        values = {"count": float(sum(clipped.values())), "of": best.fraction.of, "inputs": list(clipped)}
        yield Finding(code="inputs_clipped", values=values)


def _changes_text(changes: Settings, between: str = "\n") -> str:
    return between.join(f"{path} {setting_text(path, value)}" for path, value in changes.items())


def _remedies_table(caption: str, tried: Sequence[Remedied]) -> Table:
    rows: list[Cells] = [
        (
            each.remedies[0].name or each.code.replace("_", " "),
            _changes_text(each.changes),
            _share_text(each.judgement),
            each.judgement.verdict,
            *(given(time, "s", digits=3) for time in times_of(each.judgement).values()),
            _changes_text(each.settings),
        )
        for each in tried
    ]
    heads = ["remedy", "change", "devices that meet all", "verdict", "half within", "90 % within", "settings"]
    if not any(each.settings for each in tried):
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    return Table(caption=caption, heads=heads, rows=rows)


def if_exact(scene: SceneFile, judgement: Judgement) -> str:
    """The ending of the code of a verdict that rests on exact parts."""
    return _EXACT if judgement.verdict == MET and not (scene.uncertainty or scene.fitted.quantities) else ""


def share_values(judgement: Judgement) -> dict[str, Value]:
    """What sentences say of a fraction."""
    share = judgement.fraction
    return {
        "share": share.value,
        "low": share.low,
        "high": share.high,
        "count": share.count,
        "of": share.of,
        "asked": judgement.asked,
    }


def causes_of(judgement: Judgement) -> list[str]:
    """How many devices ended in which way without meeting what is required, most first."""
    missed = [(demand.code, ~demand.met(judgement.outcomes)) for demand in judgement.demands]
    counted = Counter(
        " and ".join(f"{name} missed" for name, misses in missed if misses[place])
        if code == _SETTLED
        else code
        for place, (code, met) in enumerate(zip(judgement.outcomes.ended, judgement.meets, strict=True))
        if not met
    )
    return [f"{code.replace('_', ' ')} {count}" for code, count in counted.most_common(_MOST_CAUSES)]


def _given_text(scene: SceneFile, path: str) -> str:
    text = setting_text(path, raw_value_at(scene, path))
    return f"{text} (default)" if scene.origin_of(path) == "default" else text


def _settings_table(tuning: Tuning) -> Table:
    rows = [
        (path, _given_text(tuning.given, path), setting_text(path, value))
        for path, value in tuning.recommended.settings.items()
    ]
    return Table(caption="Settings", heads=("key", "the scene's", "recommended"), rows=rows)


def required_table(judgement: Judgement) -> Table:
    """What is asked of every device, and how many meet it."""
    rows = [
        (
            _demand_text(each),
            f"{each.sense} {given(each.required, each.unit, digits=4)}",
            percent(judgement.fraction_of(each).value),
        )
        for each in judgement.demands
    ]
    return Table(caption="Required of every device", heads=("what", "required", "met by"), rows=rows)


def _demand_text(demand: Demand) -> str:
    what = demand.code.replace("_", " ")
    return what if demand.amplitude is None else f"{what} to {given(demand.amplitude, 'm', digits=4)}"


def _along_table(tuning: Tuning) -> Table:
    rows = [
        (
            given(each.level, tuning.along_unit, digits=4),
            _share_text(each.judgement),
            *(given(time, "s", digits=3) for time in times_of(each.judgement).values()),
            given(each.usable_moment[1], "kg m", digits=4),
        )
        for each in tuning.along
    ]
    heads = (tuning.along_name, "devices that meet all", "half within", "90 % within", "usable moment")
    return Table(caption=f"Over {tuning.along_name}", heads=heads, rows=rows)


def _tried_table(tuning: Tuning) -> Table:
    rows = [
        (
            each.kind.replace("_", " "),
            ", ".join(
                f"{path} {setting_text(path, value)}" for path, value in each.judgement.settings.items()
            ),
            _share_text(each.judgement),
        )
        for each in tuning.tried
    ]
    caption = "The best of each kind, over the devices of the search"
    return Table(caption=caption, heads=("kind", "settings", "devices"), rows=rows)


def _share_text(judgement: Judgement) -> str:
    share = judgement.fraction
    return f"{percent(share.value)} ({percent(share.low)} to {percent(share.high)})"
