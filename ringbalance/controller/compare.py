"""Two balancers side by side on one rotor, each with settings chosen by runs: what fractions settle.

Both are run as the devices of one number: with the same drawn rotor (speed, influence coefficient, unbalance
in size and direction), each with its own inputs drawn, and with noise by that number.  The rotor is that of
both scenes, or that of the one which is named; it is as uncertain as the scene that states more, and as much
is asked as by the scene that asks more.  Nothing depends on the order of the scenes.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import Balancer, Draws, Outcomes, Settings
from ringbalance.controller.judging.judge import FRESH
from ringbalance.controller.judging.search import searched
from ringbalance.controller.judging.tuning import plain_settings
from ringbalance.controller.rotor import (
    CommonRotor,
    Rotors,
    one_rotor,
    rotor_difference,
    rotor_fault,
    rotors_of,
    vibrating,
)
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.results.requirements import MET, Paired, Proportion
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import FloatArray, finite
from ringbalance.scene.describe import setting_text
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.origins import SceneFile, with_values_at

FEWEST: Final = 16
MOST: Final = 64
"""Devices, at first and at the most: doubled until a difference is shown."""
_LEVEL: Final = 0.05 / 3
"""Of the test for a difference, 0.05 in all: it is made after 16, 32 and 64 devices."""
_TRACED: Final = 4
"""Devices whose runs are kept for the largest vibration on the way."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Side:
    """One balancer of a comparison."""

    scene: SceneFile
    """On the common rotor, with the settings of its search."""
    settings: Settings
    """By path, where they differ from the scene's."""
    outcomes: Outcomes
    """By device."""
    residual_ratio: FloatArray
    """Amplitude at the end over the one before balancing, by device."""
    worst_amplitude: float
    """Median of the largest amplitude on the way of the first devices, m zero-to-peak."""
    status: str
    """Of the first of these that did not settle, else of the first."""
    energy_kind: str
    """Code of the sentence that says what is counted."""
    sampling_time: float
    """s, from one sample of the vibration to the next."""
    models_used: tuple[ModelUsed, ...] = ()
    """Of a liquid ring: every physical term, with its model and its estimated contribution."""

    @property
    def fraction(self) -> Proportion:
        """Of the devices that settle within the span."""
        settled = self.outcomes.settled
        return Proportion(count=int(np.count_nonzero(settled)), of=settled.size)

    @property
    def finding(self) -> Finding:
        """Which fraction settles, and how its runs ended."""
        share = self.fraction
        values: dict[str, Value] = {"source": self.scene.source, "text": self.status}
        values |= {"share": share.value, "low": share.low, "high": share.high, "of": share.of}
        return Finding(code="side_settled" if share.count == share.of else "side_not_settled", values=values)

    @property
    def energy(self) -> Finding:
        """What its energy is."""
        return Finding(code=self.energy_kind, values={"source": self.scene.source})

    @property
    def settings_text(self) -> str:
        """What the search has changed."""
        changed = [f"{path} = {setting_text(path, value)}" for path, value in self.settings.items()]
        return ", ".join(changed) or "the scene's"

    def middle(self, name: str) -> float | None:
        """Median over the devices that settle; None: none does."""
        return finite(float(np.median(here))) if (here := self._settled(name)).size else None

    def ends(self, name: str) -> list[float] | None:
        """Smallest and largest over the devices that settle."""
        return [float(here.min()), float(here.max())] if (here := self._settled(name)).size else None

    def _settled(self, name: str) -> FloatArray:
        values = self.residual_ratio if name == "residual_ratio" else getattr(self.outcomes, name)
        return np.asarray(values[self.outcomes.settled])

    def quantities(self, prefix: str) -> Iterator[Quantity]:
        """The fraction, then medians from the smallest to the largest. Args: `prefix`: of the keys."""
        share = self.fraction
        yield Quantity(
            key=f"{prefix}fraction_settled",
            name="devices that settle",
            value=share.value,
            lower=share.low,
            upper=share.high,
            origin="simulated",
        )
        for name, (key, words, unit) in _NUMBERS.items():
            low, high = self.ends(name) or (None, None)
            yield Quantity(
                key=prefix + key,
                name=words,
                unit=unit,
                value=self.middle(name),
                lower=low,
                upper=high,
                origin="simulated",
                status="ok" if self.outcomes.settled.any() else "not_settled",
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
            name="vibration sampled every",
            unit="s",
            value=self.sampling_time,
            origin="given",
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
    """That of both scenes, or of the one that was named."""
    span: float
    """s, from the start of balancing, of every run: the longer time limit of both scenes."""
    asked: float
    """Fraction of the devices, of the scene that asks more."""
    sides: tuple[Side, Side]
    """In the order of the scenes."""

    @property
    def paired(self) -> Paired:
        """On how many devices which of the two settles."""
        return _paired([side.outcomes for side in self.sides])

    @property
    def better(self) -> int | None:
        """Which side settles more of the devices; None: no difference is shown."""
        return self.paired.better(_LEVEL)

    @property
    def succeeded(self) -> bool:
        """True when both meet what is required of a fraction of devices."""
        return set(self.verdicts) == {MET}

    @property
    def verdicts(self) -> tuple[str, ...]:
        """Of each side on the fraction asked for."""
        return tuple(side.fraction.verdict(self.asked) for side in self.sides)

    def to_dict(self) -> dict[str, Any]:
        """All as a JSON document in SI; lists run along `scenes`; null: no device settles."""
        sides, rotor = self.sides, self.rotor
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
            **{key: [side.middle(name) for side in sides] for key, name in _KEYS.items()},
            "spread": [{key: side.ends(name) for key, name in _KEYS.items()} for side in sides],
            "worst_amplitude_m": [side.worst_amplitude for side in sides],
            "settings": [plain_settings(side.settings) for side in sides],
            "energy_kind": [side.energy.text for side in sides],
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
            },
            **self.rows().document(),
        }

    def rows(self) -> Rows:
        """What both come to."""
        rotor, sides = self.rotor, self.sides
        of_rotor = (
            ("speed", "speed", "rad/s", rotor.speed),
            ("influence", "influence coefficient", "m/(kg m)", abs(rotor.influence)),
            ("lag_angle", "lag angle", "rad", -cmath.phase(rotor.influence)),
            ("initial_amplitude", "amplitude before balancing", "m", rotor.amplitude),
            ("limit", "limit", "m", rotor.limit),
            ("noise", "noise of a sample of the vibration", "m", rotor.noise),
            ("span", "time of each run, at most", "s", self.span),
        )
        both = [tuple(side.quantities(f"{place}.")) for place, side in enumerate(sides, start=1)]
        return Rows(
            title=f"Two balancers on the rotor of {rotor.source}",
            quantities=(
                *(Quantity(key=k, name=n, unit=u, value=v, origin="given") for k, n, u, v in of_rotor),
                *both[0],
                *both[1],
            ),
            listed=len(of_rotor),
            findings=(self._finding, *(side.finding for side in sides), *(side.energy for side in sides)),
            tables=(_table(sides, both),),
        )

    @property
    def _finding(self) -> Finding:
        better, paired = self.better, self.paired
        alone = sorted((paired.first_alone, paired.second_alone))
        values: dict[str, Value] = {"of": self.sides[0].fraction.of, "fewer": alone[0], "more": alone[1]}
        if better is None:
            return Finding(code="compared_alike", values=values)
        return Finding(code="compared_better", values={**values, "source": self.sides[better].scene.source})


FIRST, SECOND = ("first", "second")
"""Names of the scenes as a rotor is asked for."""


def compare(
    first: Balancer,
    second: Balancer,
    *,
    rotor: str | None = None,
    most: int = MOST,
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Put two balancers on one rotor, choose settings for each, and run both as drawn devices.

    Args: `rotor`: "first" or "second", the scene whose rotor, sensor and limit hold for both; default that
        of both scenes. `most`: after so many a difference that cannot be told is left open.
    Raises: SceneError: the scenes describe two rotors and none is named, or a balancer cannot work on it.
    """
    told = progress or (lambda _: None)
    common, home = _common_rotor(first, second, rotor)
    rotors = rotors_of(common, first.rotor, second.rotor)
    try:
        # Whether the other can work there at all is known before anything is run.
        placed = [each.on_rotor(common, rotors) for each in (first, second)]
        span = max(each.span() for each in placed)
        both = [each.lasting(span) for each in placed]
        settings = [searched(each, progress=told) for each in both]
        outcomes = _raced(both, settings, most=most, progress=told)
        one, other = (_side(*each, rotors) for each in zip(both, settings, outcomes, strict=True))
    except SceneError as error:
        raise SceneError(_placed(home, fault) for fault in error.faults) from error
    asked = max(each.asked_fraction() for each in (first, second))
    return Comparison(rotor=common, span=span, asked=asked, sides=(one, other))


def _common_rotor(first: Balancer, second: Balancer, rotor: str | None) -> tuple[CommonRotor, SceneFile]:
    """The rotor for both, and the scene that it is taken from."""
    if rotor is not None:
        home = {FIRST: first, SECOND: second}[rotor]
        return vibrating(home.scene, home.rotor()), home.scene
    one, other = (vibrating(each.scene, each.rotor()) for each in (first, second))
    if (name := rotor_difference(one, other)) is not None:
        problem = f"another {name} than in {other.source}: two rotors, and neither is named for both"
        allowed = f"one rotor in both scenes, or --rotor {FIRST} or {SECOND}"
        raise rotor_fault(first.scene, "rotor", problem, allowed)
    common = one_rotor(one, other)
    return common, first.scene if common.source == one.source else second.scene


def _placed(home: SceneFile, fault: Fault) -> Fault:
    if fault.file == home.file:
        return fault
    return replace(fault, problem=f"on the rotor of {home.source}: {fault.problem}")


def _raced(
    both: Sequence[Balancer], settings: Sequence[Settings], *, most: int, progress: Callable[[str], None]
) -> list[Outcomes]:
    """Both over the same devices, twice as many each time until a difference is shown."""
    whole: list[Outcomes] = []
    more = min(FEWEST, most)
    while more:
        count = whole[0].settled.size if whole else 0
        progress(f"{count} of at most {most} drawn devices")
        draws = Draws.block(FRESH + count, more)
        ran = [each.run_all([asked], draws)[0] for each, asked in zip(both, settings, strict=True)]
        whole = [a.joined(b) for a, b in zip(whole, ran, strict=True)] if whole else ran
        more = 0 if _paired(whole).better(_LEVEL) is not None else min(count + more, most - count - more)
    return whole


def _paired(outcomes: Sequence[Outcomes]) -> Paired:
    first, second = (each.settled for each in outcomes)
    return Paired.of(first, second)


def _side(balancer: Balancer, settings: Settings, outcomes: Outcomes, rotors: Rotors) -> Side:
    before = np.array([rotors(FRESH + number).amplitude for number in range(outcomes.settled.size)])
    traced = balancer.run(settings, Draws.block(FRESH, _TRACED), trace=True).traced
    told = next((each for each in traced if not each.settled), traced[0])
    ready = balancer.on_scene(with_values_at(balancer.scene, settings))
    return Side(
        scene=ready.scene,
        settings=settings,
        outcomes=outcomes,
        residual_ratio=outcomes.final_amplitude / before,
        worst_amplitude=float(np.median([each.worst_amplitude for each in traced])),
        status=told.run.status,
        energy_kind=balancer.energy_kind,
        sampling_time=balancer.sampling_time(),
        models_used=ready.models_used,
    )


_NUMBERS: Final = {
    "settling_time": ("time", "time to the limit, of those that settle", "s"),
    "residual_ratio": ("residual_ratio", "left over, ratio", "1"),
    "energy": ("energy", "energy", "J"),
}
"""Numbers by device: key, words and unit."""
_KEYS: Final = {"time_s": "settling_time", "residual_ratio": "residual_ratio", "energy_J": "energy"}
"""Of the document, each with its number by device."""


def _table(sides: Sequence[Side], both: Sequence[Sequence[Quantity]]) -> Table:
    """One column a balancer."""
    names = [side.scene.name for side in sides]
    heads = names if len(set(names)) > 1 else [side.scene.source for side in sides]
    rows = [
        ("balancer", *(side.scene.balancer.replace("_", " ") for side in sides)),
        ("settings", *(side.settings_text for side in sides)),
    ]
    rows += [(one.name, one.text, other.text) for one, other in zip(*both, strict=True)]
    note = "medians of the devices that settle; -/+: to the smallest and the largest"
    return Table(heads=("", *heads), rows=rows, note=note)
