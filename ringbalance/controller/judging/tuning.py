"""Result of `tune`: recommended settings, their judgement, and what would improve it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Final

import numpy as np

from ringbalance.controller.balance_grades import grade_quantities
from ringbalance.controller.balancer import ROTOR_AMPLITUDE, WATCH_TIME_S, Demand, Settings
from ringbalance.controller.judging.holding import Endurance
from ringbalance.controller.judging.judge import Judgement, plain_settings
from ringbalance.controller.judging.ranking import Ranking
from ringbalance.controller.judging.remedies import Remedied
from ringbalance.controller.judging.search import ScanLevel
from ringbalance.controller.rotor import CommonRotor, assumed_rotor
from ringbalance.controller.trials import Information
from ringbalance.results.numbers import format_given, percent
from ringbalance.results.requirements import MET, MISSED, OPEN
from ringbalance.results.result import Cells, Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import finite
from ringbalance.scene.changes import rechecked
from ringbalance.scene.describe import setting_text
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.origins import SceneFile, raw_value_at, with_values_at

LONG_WATCH_TIME_S: Final = 300.0
"""Time for which settled devices are watched once more under the recommended settings, s."""
_VERDICT_CODES: Final = {MET: "tuned_met", MISSED: "tuned_missed", OPEN: "tuned_open"}
_PART_CODES: Final = {MET: "part_met", MISSED: "part_missed", OPEN: "part_open"}
_EXACT: Final = "_exact"
"""Suffix of the code of a met verdict where the scene states no uncertainty."""
_CHOICES_CAPTION: Final = "Valves that can be bought, each with the best settings of a coarse grid"


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
    """The scene that was tuned."""
    recommended: Judgement
    own: Judgement | None
    """Judgement of the scene's own settings on the same devices; None: the scene states none."""
    longer: Judgement | None
    """Judgement of the recommended settings with a longer watch time; None: runs go to their end."""
    tried: Mapping[str, Judgement]
    """Judgement of the best settings by kind of controller, on the devices of the search."""
    along: tuple[ScanLevel, ...] = ()
    """Best settings at every level of the scan axis, such as the gas pressure."""
    along_name: str = ""
    """Path of the scan axis."""
    along_unit: str = "1"
    information: Information = field(default_factory=Information)
    rotor: CommonRotor | None = None
    """Rotor of the scene; None: it never vibrates steadily."""
    remedies: tuple[Remedied, ...] = ()
    """Judged changes of the scene, the best first; tried where the requirement is not met."""
    capacity: tuple[Finding, ...] = ()
    """Findings on liquid that a machine moves beyond the capacity that decides a verdict."""
    ranking: Ranking = field(default_factory=Ranking)
    """Influence of the drawn inputs under the recommended settings."""
    choices: tuple[Remedied, ...] = ()
    """Judged parts that can be bought for what the scene leaves open."""
    open_choice: bool = False
    """True if the scene leaves the choice of a part open; `recommended` then has an ideal one."""
    endurance: Endurance | None = None
    """Devices over the hours of holding; None: the loss of liquid is not known, or not required."""

    @property
    def best_choice(self) -> Remedied | None:
        """Part that can be bought with the largest fraction of devices; None: none was judged."""
        return max(self.choices, key=lambda each: (each.met, each.judgement.fraction.value), default=None)

    @property
    def judgement(self) -> Judgement:
        """Judgement that decides the verdict: of the best part that can be bought, else of `recommended`."""
        return self.best_choice.judgement if self.best_choice else self.recommended

    @property
    def changes(self) -> Settings:
        """Recommended settings by path, SI, with the part that can be bought where it suffices."""
        part = self.best_choice
        return {**part.changes, **part.settings} if part and part.met else self.recommended.settings

    @property
    def scene(self) -> Any:
        """The scene with the recommended settings, of the same type."""
        return with_values_at(self.given, self.changes)

    @property
    def recommended_scene(self) -> AnyScene:
        """The scene with the recommended settings, validated; its hash is new."""
        return rechecked(self.scene)

    @property
    def succeeded(self) -> bool:
        """True if what the scene requires is met, with a part that can be bought where one was judged."""
        return self.judgement.verdict == MET

    @property
    def status(self) -> str:
        """The first two findings as text."""
        return "; ".join(finding.text for finding in islice(self._findings(), 2))

    def to_dict(self) -> dict[str, Any]:
        scene, best = self.given, self.recommended
        ideal_part = {**best.document(), "settings": plain_settings(best.settings)}
        return {
            "scene": {"name": scene.name, "source": scene.source, "sha256": scene.sha256},
            "balancer": scene.balancer,
            "status": self.status,
            "asked": best.required_fraction,
            **self.judgement.document(),
            "settings": plain_settings(self.changes),
            "ideal_part": ideal_part if self.open_choice else None,
            "own": self.own and self.own.document(),
            "further_s": WATCH_TIME_S,
            "longer": self.longer
            and {"further_s": LONG_WATCH_TIME_S, "fraction": self.longer.fraction.document()},
            "required": self.judgement.demands_document(),
            "along": {
                "path": self.along_name,
                "unit": self.along_unit,
                "levels": [
                    {
                        "value": each.level,
                        "settings": plain_settings(each.judgement.settings),
                        **each.judgement.document(),
                        "usable_moment_kg_m": dict(
                            zip(("p10", "p50", "p90"), map(finite, each.usable_moment), strict=True)
                        ),
                    }
                    for each in self.along
                ],
            },
            "tried": [
                {
                    "kind": kind,
                    "settings": plain_settings(judgement.settings),
                    "fraction": judgement.fraction.document(),
                }
                for kind, judgement in self.tried.items()
            ],
            "remedies": [each.document() for each in self.remedies],
            "valves": [each.document() for each in self.choices],
            "ranking": self.ranking.document(),
            "clipped": dict(best.outcomes.clipped),
            **({"endurance": self.endurance.document()} if self.endurance else {}),
            **self.information.document,
            **self.rows().document(),
        }

    def rows(self) -> Rows:
        """The result as quantities, findings and tables."""
        scene = self.given
        settings = []
        for path, value in self.changes.items():
            before = setting_text(path, raw_value_at(scene, path))
            before += " (default)" if scene.origin_of(path) == "default" else ""
            settings.append((path, before, setting_text(path, value)))
        levels = [
            (
                format_given(each.level, self.along_unit, digits=4),
                *_fraction_and_times(each.judgement),
                format_given(each.usable_moment[1], "kg m", digits=4),
            )
            for each in self.along
        ]
        kinds = [
            (kind.replace("_", " "), _changes_text(each.settings, ", "), _fraction_and_times(each)[0])
            for kind, each in self.tried.items()
        ]
        return Rows(
            title=f"Tuning of {scene.name} ({scene.source})",
            quantities=(*self._quantities(), *self.information.quantities),
            findings=tuple(self._findings()),
            facts=self.information.facts,
            tables=(
                Table(caption="Settings", heads=("key", "the scene's", "recommended"), rows=settings),
                required_table(self.judgement),
                Table(
                    caption=f"Over {self.along_name}",
                    heads=(self.along_name, *_FRACTION_AND_TIMES, "usable moment"),
                    rows=levels,
                ),
                Table(
                    caption="The best of each kind, over the devices of the search",
                    heads=("kind", "settings", "devices"),
                    rows=kinds,
                ),
                _remedies_table("Remedies, each with its best settings", self.remedies),
                _remedies_table(_CHOICES_CAPTION, self.choices),
                *((self.endurance.table,) if self.endurance else ()),
            ),
        )

    def _quantities(self) -> Iterator[Quantity]:
        ideal, with_ideal = ("with an ideal valve, ", self.recommended) if self.choices else ("", None)
        for key, name, judgement in (
            ("fraction_met", "devices that meet what is required", self.judgement),
            ("fraction_met_ideal", "the same with an ideal valve", with_ideal),
            ("fraction_met_own", f"the same {ideal}with the scene's own settings", self.own),
            ("fraction_met_longer", f"the same, {ideal}watched longer", self.longer),
        ):
            if judgement is not None:
                yield Quantity.of_fraction(judgement.fraction, key=key, name=name)
        yield from reported_quantities(self.judgement)
        times = self.judgement.settling_times
        for part, name in (("p50", "half of them settle within"), ("p90", "nine tenths settle within")):
            status = "ok" if times[part] is not None else "not_reached"
            yield Quantity.simulated(f"settling_time_{part}", name, times[part], "s", status)
        yield from self.standards

    @property
    def standards(self) -> Iterator[Quantity]:
        """Residual unbalance that the judged settings achieve, its grade, and what API 617 allows."""
        rotor, judgement = self.rotor, self.judgement
        if rotor is None or (amplitude := judgement.amplitude_reached) is None:
            return
        residual, limit = (each / abs(rotor.influence) for each in (amplitude, rotor.limit))
        reached_by = f"by {percent(judgement.required_fraction)} of the devices"
        name = f"minimum achievable residual unbalance (ISO 21940-21), with these settings, {reached_by}"
        yield Quantity.simulated("minimum_achievable_unbalance", name, residual, "kg m")
        yield from grade_quantities(
            mass=rotor.mass, speed=rotor.speed, residual=residual, limit=limit, reached_by=reached_by
        )

    def _findings(self) -> Iterator[Finding]:
        """Sentences on the verdict, the settling times, the scene's own settings, causes and remedies."""
        best, unchanged, met = self.recommended, self.own, self.recommended.verdict == MET
        changes = {
            path: value[0] if isinstance(value, tuple) else value
            for path, value in best.settings.items()
            if value is not None
        }
        if part := self.best_choice:
            values = {**part.judgement.sentence_values, "name": part.remedies[0].name}
            values["parts"] = len(self.choices)
            assumed = part.assumed
            values["if"] = f" if it has the {assumed} that the program assumes" if assumed else ""
            yield Finding(code=_PART_CODES[part.judgement.verdict], values=values, change=part.changes)
        code = _VERDICT_CODES[best.verdict] + if_exact(self.given, best)
        values = {**best.sentence_values, "part": " and an ideal valve" if self.open_choice else ""}
        yield Finding(code=code, values=values, change=changes)
        # With parts that can be bought the times are among the quantities, of the part.
        if not self.choices:
            yield from time_findings(best)
        yield from reported_findings(best)
        if unchanged is None:
            yield Finding(code="tuned_own_none")
        elif not best.settings:
            yield Finding(code="tuned_own_best")
        else:
            values = {**unchanged.sentence_values, "verdict": unchanged.verdict}
            yield Finding(code="tuned_own", values=values)
        if self.longer is not None:
            values = {**self.longer.sentence_values, "time": LONG_WATCH_TIME_S, "first": WATCH_TIME_S}
            yield Finding(code="tuned_longer", values=values)
        if self.endurance is not None:
            yield self.endurance.finding
        if not met and best.causes:
            yield Finding(code="tuned_causes", values={"causes": best.causes})
        yield from self.capacity
        if not met and self.along and not self.remedies:
            yield Finding(code="tuned_no_level", values={"key": self.along_name})
        yield from assumed_rotor(self.scene)
        meeting = tuple(each for each in self.remedies if each.met)
        for remedy in (meeting or self.remedies)[:1]:
            code = "remedy_meets" if remedy.met else "remedy_best"
            values = {**remedy.judgement.sentence_values, "what": _changes_text(remedy.changes, ", ")}
            yield Finding(code=code, values=values, change=remedy.changes)
        if not met:
            yield from self.ranking.findings()
            states_amplitude = any(each.stated and each.outcome == "final_amplitude" for each in best.demands)
            if states_amplitude and (amplitude := best.amplitude_reached) is not None:
                values = {"amplitude": amplitude, "asked": best.required_fraction}
                yield Finding(code="amplitude_reached", values=values)
        if self.open_choice and not self.choices:
            yield Finding(code="ideal_valve")
        if clipped := best.outcomes.clipped:
            values = {"count": float(sum(clipped.values())), "of": best.fraction.of, "inputs": list(clipped)}
            yield Finding(code="inputs_clipped", values=values)
        yield from self.information.findings


def if_exact(scene: SceneFile, judgement: Judgement) -> str:
    """Suffix of the code of a met verdict where the scene states no uncertainty; else empty."""
    return _EXACT if judgement.verdict == MET and not (scene.uncertainty or scene.fitted.quantities) else ""


def reported_quantities(judgement: Judgement) -> Iterator[Quantity]:
    """Readings and rotors apart where the sensor has a runout; the crater where the scene gives the hole."""
    if (rotor := _of_rotor(judgement)) is not None:
        for key, name, demand in (
            ("fraction_reading", "devices whose reading settles in time", judgement.demands[0]),
            ("fraction_rotor", "devices whose rotor is within the limit at the end", rotor),
        ):
            yield Quantity.of_fraction(judgement.fraction_of(demand), key=key, name=name)
    if (crater := judgement.crater_reached) is not None:
        name = "crater over the ring in nine tenths at most"
        yield Quantity(key="crater_reached", name=name, value=crater, origin="simulated", digits=2)


def time_findings(judgement: Judgement) -> Iterator[Finding]:
    """Finding on the times within which half and nine tenths settle; none where less than half do."""
    times = judgement.settling_times
    if times["p50"] is not None:
        code = "tuned_half" if times["p90"] is None else "tuned_times"
        yield Finding(code=code, values={"half": times["p50"], "most": times["p90"]})


def reported_findings(judgement: Judgement) -> Iterator[Finding]:
    """Findings on the runout of the sensor, and on a crater that nothing limits."""
    yield from runout_findings(judgement)
    crater = judgement.crater_reached
    if crater is not None and all(each.code != "crater" for each in judgement.demands):
        yield Finding(code="crater_not_required", values={"crater": crater})


def runout_findings(judgement: Judgement) -> Iterator[Finding]:
    """Finding on readings and rotors of the devices; none where the sensor has no runout."""
    if (rotor := _of_rotor(judgement)) is not None:
        values: dict[str, Value] = {
            "reading": judgement.fraction_of(judgement.demands[0]).value,
            "rotor": judgement.fraction_of(rotor).value,
            "limit": rotor.required,
            "median": float(np.median(judgement.outcomes.final_amplitude)),
        }
        yield Finding(code="tuned_runout", values=values)


def _of_rotor(judgement: Judgement) -> Demand | None:
    """Demand on the vibration of the rotor itself; None where the sensor has no runout."""
    demands = (*judgement.demands, *judgement.reported)
    return next((each for each in demands if each.code == ROTOR_AMPLITUDE), None)


def required_table(judgement: Judgement) -> Table:
    """Table of the demands, each with the fraction of devices that meets it."""
    rows = []
    for demand in judgement.demands:
        what = demand.code.replace("_", " ")
        what += "" if demand.amplitude is None else f" to {format_given(demand.amplitude, 'm', digits=4)}"
        required = f"{demand.sense} {format_given(demand.required, demand.unit, digits=4)}"
        rows.append((what, required, percent(judgement.fraction_of(demand).value)))
    return Table(caption="Required of every device", heads=("what", "required", "met by"), rows=rows)


_FRACTION_AND_TIMES: Final = ("devices that meet all", "half within", "90 % within")


def _fraction_and_times(judgement: Judgement) -> Cells:
    """Cells below the heads `_FRACTION_AND_TIMES`."""
    share = judgement.fraction
    fraction = f"{percent(share.value)} ({percent(share.low)} to {percent(share.high)})"
    return (fraction, *(format_given(time, "s", digits=3) for time in judgement.settling_times.values()))


def _changes_text(changes: Mapping[str, Any], separator: str = "\n") -> str:
    return separator.join(f"{path} {setting_text(path, value)}" for path, value in changes.items())


def _remedies_table(caption: str, remedies: tuple[Remedied, ...]) -> Table:
    """Table of judged remedies with their changes and settings."""
    rows: list[Cells] = []
    for each in remedies:
        name = each.remedies[0].name or each.code.replace("_", " ")
        fraction, *times = _fraction_and_times(each.judgement)
        changes = _changes_text({**each.changes, **each.settings})
        rows.append((name, fraction, each.judgement.verdict, *times, changes))
    heads = ("remedy", "devices that meet all", "verdict", "half within", "90 % within")
    return Table(caption=caption, heads=(*heads, "changes and settings"), rows=rows)
