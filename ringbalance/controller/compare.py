"""Comparison of two balancers on one rotor, each with settings chosen by runs.

Both run as the same numbered devices: with the same drawn rotor (speed, influence coefficient, unbalance in
size and direction) and noise, each with its own inputs drawn.  The rotor is the one that both scenes
describe, or that of the scene named.  Its uncertainty is that of the scene that states more, and the required
fraction that of the scene that requires more, so that nothing depends on the order of the scenes.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import (
    ENERGY_NONE,
    ROTOR_AMPLITUDE,
    Balancer,
    Demand,
    Draws,
    Outcomes,
    Settings,
)
from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE, plain_settings
from ringbalance.controller.judging.search import searched
from ringbalance.controller.rotor import (
    CommonRotor,
    joined_rotor,
    rotor_difference,
    rotor_fault,
    rotors_of,
    vibrating,
)
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.results.numbers import format_given
from ringbalance.results.requirements import MET, Paired, Proportion
from ringbalance.results.result import Cells, Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value, text_of
from ringbalance.scene.arrays import BoolArray, FloatArray, finite
from ringbalance.scene.describe import setting_text
from ringbalance.scene.faults import SceneError
from ringbalance.scene.origins import SceneFile, with_values_at

FIRST_DEVICES: Final = 16
MAX_DEVICES: Final = 64
"""Numbers of devices, first and largest; doubled until a difference is shown."""
_DIFFERENCE_LEVEL: Final = 0.05 / 3
"""Significance level of each of the tests after 16, 32 and 64 devices; 0.05 for all three together."""
_TRACED_DEVICES: Final = 4
"""Number of devices whose largest vibration is recorded."""
_DEVICE_NUMBERS: Final = (
    ("time_s", "settling_time", "time", "time to the limit, of those that settle", "s"),
    ("residual_ratio", "residual_ratio", "residual_ratio", "left over, ratio", "1"),
    ("energy_J", "energy", "energy", "energy", "J"),
)
"""Numbers of a device: JSON key, attribute, key of the quantity, its name and unit."""
FIRST, SECOND = ("first", "second")
"""Names of the scenes in the argument `rotor`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Side:
    """Results of one balancer of a comparison."""

    scene: SceneFile
    """The scene on the common rotor, with the settings of the search."""
    settings: Settings
    """Settings that differ from the scene's, by path, SI."""
    outcomes: Outcomes
    residual_ratio: FloatArray
    """Final amplitude over the one before balancing, by device."""
    worst_amplitude: float
    """Median of the largest amplitudes of the traced devices, m zero-to-peak."""
    status: str
    """Status of the first traced run that did not settle, else of the first traced run."""
    energy_kind: str
    """Code of the sentence that names the energy counted."""
    sampling_time: float | None
    """Time from one vibration sample to the next, s; None: it takes no samples."""
    models_used: tuple[ModelUsed, ...] = ()
    """Physical terms with model and estimated contribution, for a liquid ring."""
    time: float = math.inf
    """Required settling time of the rotor, s; infinite: none."""
    within: Demand | None = None
    """Demand on the rotor itself, of which the reading differs; None: the sensor has no runout."""

    @property
    def served(self) -> BoolArray:
        """True for each device that settles within the required time, by its reading, and whose rotor is
        within the limit where the scene requires that."""
        return served(self.outcomes, self.within, self.time)

    @property
    def fraction(self) -> Proportion:
        """Fraction of the devices that are served."""
        return Proportion.where(self.served)

    def middle(self, name: str) -> float | None:
        """Median of a device number over the devices that settle; None: none does."""
        values = self._of_settled(name)
        return finite(float(np.median(values))) if values.size else None

    def ends(self, name: str) -> list[float] | None:
        """Minimum and maximum of a device number over the devices that settle; None: none does."""
        values = self._of_settled(name)
        return [float(values.min()), float(values.max())] if values.size else None

    def _of_settled(self, name: str) -> FloatArray:
        if name == "energy" and self.energy_kind == ENERGY_NONE:
            return np.zeros(0)
        values = self.residual_ratio if name == "residual_ratio" else getattr(self.outcomes, name)
        return np.asarray(values[self.outcomes.settled])

    def quantities(self, prefix: str) -> Iterator[Quantity]:
        """The fraction that settles, then medians with minimum and maximum. Args: `prefix`: of the keys."""
        name = "devices that settle"
        settled = Proportion.where(self.outcomes.settled)
        yield Quantity.of_fraction(settled, key=f"{prefix}fraction_settled", name=name)
        if math.isfinite(self.time):
            name, settled = "the same, in time", Proportion.where(self.outcomes.settling_time <= self.time)
            yield Quantity.of_fraction(settled, key=f"{prefix}fraction_in_time", name=name)
        if self.within is not None:
            rotors, name = (
                Proportion.where(self.within.met(self.outcomes)),
                "rotors within the limit at the end",
            )
            yield Quantity.of_fraction(rotors, key=f"{prefix}fraction_rotor", name=name)
        for _, name, key, words, unit in _DEVICE_NUMBERS:
            low, high = self.ends(name) or (None, None)
            status = "ok" if self.outcomes.settled.any() else "not_settled"
            yield Quantity(
                key=prefix + key,
                name=words,
                unit=unit,
                value=self.middle(name),
                lower=low,
                upper=high,
                origin="simulated",
                status=ENERGY_NONE if name == "energy" and self.energy_kind == ENERGY_NONE else status,
            )
        yield Quantity(
            key=f"{prefix}worst_amplitude",
            name="largest amplitude on the way",
            unit="m",
            value=self.worst_amplitude,
            origin="simulated",
        )
        yield Quantity(
            key=f"{prefix}sampling_time",
            name="time between samples of the vibration",
            unit="s",
            value=self.sampling_time,
            origin="given",
            status="ok" if self.sampling_time else "not_sampled",
        )


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class Comparison(Result):
    """Two balancers on one rotor.

    Example:
        >>> first, second = (rb.load_scene(rb.bundled_scene(n)) for n in ("liquid_ring_paper", "six_chamber"))
        >>> comparison = rb.compare(first, second, rotor="first")
        >>> [scene["name"] for scene in comparison.to_dict()["scenes"]]
        ["Pan's liquid-ring disc", 'Six-chamber disc']
    """

    rotor: CommonRotor
    """Rotor of both scenes, or of the scene named."""
    span: float
    """Length of every run from the start of balancing, s: the longer time limit of both scenes."""
    asked: float
    """Required fraction of devices that settle, of the scene that requires more."""
    sides: tuple[Side, Side]
    """Results in the order of the scenes."""

    @property
    def paired(self) -> Paired:
        """Counts of devices that settle on both sides, on one, on neither."""
        return Paired.of(*(side.served for side in self.sides))

    @property
    def better(self) -> int | None:
        """Index of the side that settles more devices; None: no difference is shown."""
        return self.paired.better(_DIFFERENCE_LEVEL)

    @property
    def succeeded(self) -> bool:
        """True if both balancers meet the required fraction of devices."""
        return set(self.verdicts) == {MET}

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Verdict of each side on the required fraction."""
        return tuple(side.fraction.verdict(self.asked) for side in self.sides)

    def to_dict(self) -> dict[str, Any]:
        """The comparison as JSON, SI; lists run along `scenes`; null: none settles, or none stated."""
        sides, rotor = self.sides, self.rotor
        numbers = [(key, name) for key, name, *_ in _DEVICE_NUMBERS]
        return {
            "scenes": [
                {"name": side.scene.name, "source": side.scene.source, "sha256": side.scene.sha256}
                for side in sides
            ],
            "balancer": [side.scene.balancer for side in sides],
            "fraction": [side.fraction.document() for side in sides],
            "asked": self.asked,
            "verdict": list(self.verdicts),
            "better": self.better,
            "pairs": self.paired.document(),
            **{key: [side.middle(name) for side in sides] for key, name in numbers},
            "spread": [{key: side.ends(name) for key, name in numbers} for side in sides],
            "worst_amplitude_m": [side.worst_amplitude for side in sides],
            "settings": [plain_settings(side.settings) for side in sides],
            "energy_kind": [text_of(side.energy_kind, source=side.scene.source) for side in sides],
            "sampling_time_s": [side.sampling_time for side in sides],
            "span_s": self.span,
            "status": [side.status for side in sides],
            "models_used": [[asdict(used) for used in side.models_used] for side in sides],
            "rotor": {
                "source": rotor.source,
                "speed_rad_s": rotor.speed,
                "influence_m_per_kg_m": [rotor.influence.real, rotor.influence.imag],
                "unbalance_kg_m": [rotor.unbalance.real, rotor.unbalance.imag],
                "initial_amplitude_m": rotor.amplitude,
                "noise_m": rotor.noise,
                "limit_m": rotor.limit,
                "settling_time_s": rotor.settling_time,
            },
            **self.rows().document(),
        }

    def rows(self) -> Rows:
        """The comparison as quantities, findings and a table with one column a balancer."""
        rotor, sides = self.rotor, self.sides
        of_rotor = [
            Quantity(key=key, name=name, unit=unit, value=value, origin="given")
            for key, name, unit, value in (
                ("speed", "speed", "rad/s", rotor.speed),
                ("influence", "influence coefficient", "m/(kg m)", abs(rotor.influence)),
                ("lag_angle", "lag angle", "rad", -cmath.phase(rotor.influence)),
                ("initial_amplitude", "amplitude before balancing", "m", rotor.amplitude),
                ("limit", "limit", "m", rotor.limit),
                ("noise", "noise of a sample of the vibration", "m", rotor.noise),
                ("span", "time of each run, at most", "s", self.span),
            )
        ]
        in_time = ""
        if (time := rotor.settling_time) is not None:
            in_time, name = f" within {format_given(time, 's', digits=4)}", "settling time required"
            of_rotor.append(Quantity(key="required_time", name=name, unit="s", value=time, origin="given"))
        if rotor.runout is not None:
            size = rotor.runout.amplitude
            of_rotor.append(Quantity(key="runout", name="runout", unit="m", value=size, origin="given"))
        of_sides = [tuple(side.quantities(f"{number}.")) for number, side in enumerate(sides, start=1)]

        # The verdict on both, then settling and kind of energy of each.
        fewer, more = sorted((self.paired.first_alone, self.paired.second_alone))
        values: dict[str, Value] = {"of": sides[0].fraction.of, "fewer": fewer, "more": more}
        values["in_time"] = in_time
        code = "compared_alike"
        if self.better is not None:
            code, values["source"] = "compared_better", sides[self.better].scene.source
        findings = [Finding(code=code, values=values)]
        if rotor.runout is not None:
            decides = (
                "devices whose rotor is within the limit at the end" if rotor.limits_rotor else "readings"
            )
            values = {"runout": rotor.runout.amplitude, "decides": decides}
            findings.append(Finding(code="compared_runout", values=values))
        for side in sides:
            share = side.fraction
            values = {"source": side.scene.source, "text": side.status, "in_time": in_time}
            values |= {"share": share.value, "low": share.low, "high": share.high, "of": share.of}
            code = "side_settled" if share.count == share.of else "side_not_settled"
            findings.append(Finding(code=code, values=values))
        kinds = [(side.energy_kind, {"source": side.scene.source}) for side in sides]
        findings += [Finding(code=code, values=values) for code, values in kinds]

        heads = [side.scene.name for side in sides]
        if len(set(heads)) == 1:
            heads = [side.scene.source for side in sides]
        changed = [
            ", ".join(f"{path} = {setting_text(path, value)}" for path, value in side.settings.items())
            for side in sides
        ]
        cells: list[Cells] = [
            ("balancer", *(side.scene.balancer.replace("_", " ") for side in sides)),
            ("settings", *(text or "the scene's" for text in changed)),
            *((left.name, _cell(left), _cell(right)) for left, right in zip(*of_sides, strict=True)),
        ]
        note = "medians of the devices that settle, with the smallest and the largest"
        return Rows(
            title=f"Two balancers on the rotor of {rotor.source}",
            quantities=(*of_rotor, *of_sides[0], *of_sides[1]),
            listed=len(of_rotor),
            findings=tuple(findings),
            tables=(Table(heads=("", *heads), rows=cells, note=note),),
        )


def compare(
    first: Balancer,
    second: Balancer,
    *,
    rotor: str | None = None,
    most: int = MAX_DEVICES,
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Put two balancers on one rotor, choose settings for each, and run both as the same drawn devices.

    Args: `rotor`: "first" or "second", the scene whose rotor, sensor and limit hold for both; default the
        rotor that both describe. `most`: number of devices after which a difference is left open.
    Raises: SceneError: the scenes describe different rotors and none is named, or a balancer cannot work on
        the rotor.
    """
    report = progress or (lambda _: None)
    if rotor is not None:
        home = {FIRST: first, SECOND: second}[rotor].scene
        common = vibrating(home, {FIRST: first, SECOND: second}[rotor].rotor())
    else:
        described, other = (vibrating(each.scene, each.rotor()) for each in (first, second))
        if (name := rotor_difference(described, other)) is not None:
            problem = f"another {name} than in {other.source}: two rotors, and neither is named for both"
            allowed = f"one rotor in both scenes, or --rotor {FIRST} or {SECOND}"
            raise rotor_fault(first.scene, "rotor", problem, allowed)
        common = joined_rotor(described, other)
        home = first.scene if common.source == described.source else second.scene
    rotors = rotors_of(common, first.rotor, second.rotor)
    try:
        # A balancer that cannot work on the rotor is refused before anything runs.
        mounted = [each.on_rotor(common, rotors) for each in (first, second)]
        span = max(each.span() for each in mounted)
        balancers = [each.lasting(span) for each in mounted]
        settings = [searched(each, progress=report) for each in balancers]
        within = [
            next((d for d in (*each.demands(), *each.reported()) if d.code == ROTOR_AMPLITUDE), None)
            for each in balancers
        ]
        time = math.inf if common.settling_time is None else common.settling_time
        outcomes = _run_both(balancers, settings, within, time, most=most, progress=report)
        sides = []
        for balancer, chosen, ended, demand in zip(balancers, settings, outcomes, within, strict=True):
            numbers = range(FIRST_VERDICT_DEVICE, FIRST_VERDICT_DEVICE + ended.settled.size)
            before = np.array([rotors(number).amplitude for number in numbers])
            draws = Draws.block(FIRST_VERDICT_DEVICE, _TRACED_DEVICES)
            traced = balancer.run(chosen, draws, trace=True).traced
            shown = next((run for run in traced if not run.settled or run.settling_time > time), traced[0])
            tuned = balancer.on_scene(with_values_at(balancer.scene, chosen))
            sides.append(
                Side(
                    scene=tuned.scene,
                    settings=chosen,
                    outcomes=ended,
                    residual_ratio=ended.final_amplitude / before,
                    worst_amplitude=float(np.median([run.worst_amplitude for run in traced])),
                    status=shown.run.status,
                    energy_kind=balancer.energy_kind,
                    sampling_time=balancer.sampling_time() or None,
                    models_used=tuned.models_used,
                    time=time,
                    within=demand,
                )
            )
    except SceneError as error:
        prefix = f"on the rotor of {home.source}: "
        raise SceneError(
            fault if fault.file == home.file else replace(fault, problem=prefix + fault.problem)
            for fault in error.faults
        ) from error
    required = max(first.required_fraction(), second.required_fraction())
    return Comparison(rotor=common, span=span, asked=required, sides=(sides[0], sides[1]))


def served(outcomes: Outcomes, within: Demand | None, time: float) -> BoolArray:
    """True for each device of `Side.served`."""
    in_time = outcomes.settled & (outcomes.settling_time <= time)
    return in_time if within is None or not within.stated else in_time & within.met(outcomes)


def _cell(quantity: Quantity) -> str:
    """Text of a quantity of one side; a median with the smallest and the largest, three digits each."""
    name = quantity.key.partition(".")[2]
    if quantity.lower is None or name not in {key for _, _, key, *_ in _DEVICE_NUMBERS}:
        return quantity.text
    numbers = (quantity.value, quantity.lower, quantity.upper)
    value, low, high = (format_given(each, quantity.unit, digits=3) for each in numbers)
    return f"{value} ({low} to {high})"


def _run_both(
    balancers: Sequence[Balancer],
    settings: Sequence[Settings],
    within: Sequence[Demand | None],
    time: float,
    *,
    most: int,
    progress: Callable[[str], None],
) -> list[Outcomes]:
    """Run both balancers as the same devices, whose number doubles until a difference is shown."""
    outcomes: list[Outcomes] = []
    count, block = 0, min(FIRST_DEVICES, most)
    while block:
        progress(f"{count} of at most {most} drawn devices")
        draws = Draws.block(FIRST_VERDICT_DEVICE + count, block)
        new = [
            balancer.run_all([chosen], draws)[0] for balancer, chosen in zip(balancers, settings, strict=True)
        ]
        outcomes = [a.joined(b) for a, b in zip(outcomes, new, strict=True)] if outcomes else new
        count += block
        difference = Paired.of(*map(served, outcomes, within, (time, time))).better(_DIFFERENCE_LEVEL)
        block = 0 if difference is not None else min(count, most - count)
    return outcomes
