"""Two balancers side by side on one rotor, both tuned: time, residual, energy and the worst amplitude."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np

from ringbalance.controller.balancer import Balancer, Draws
from ringbalance.controller.common_rotor import CommonRotor, vibrating
from ringbalance.controller.judging.tuning_rows import setting_text
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.results.result import Result, Rows, Table
from ringbalance.results.rows import Finding, Quantity, Value
from ringbalance.scene.arrays import finite
from ringbalance.scene.faults import Fault, SceneError
from ringbalance.scene.origins import SceneFile

RUNS: Final = 5
"""Of each balancer, with the seeds that follow its scene's."""


@dataclass(frozen=True, kw_only=True)
class _RunResult:
    """What one run of a balancer comes to, over the common span."""

    time: float
    """s, from the start of balancing until the amplitude has settled; infinite when it has not."""
    residual_ratio: float
    """Amplitude at the end over the one before balancing."""
    energy: float
    """What the balancer took, J: compressing the gas that it used, or the motors' electrical energy."""
    worst_amplitude: float
    """Largest amplitude from the start of balancing on, m zero-to-peak."""
    status: str
    """How the run ended and what to do next."""


@dataclass(frozen=True, kw_only=True)
class Side:
    """One balancer of a comparison."""

    scene: SceneFile
    """As it was run, on the common rotor and tuned, with the seed of the first run."""
    tuned: Mapping[str, Any]
    """Scene keys that tuning has changed, with their values, SI."""
    results: tuple[_RunResult, ...]
    """One for each seed."""
    models_used: tuple[ModelUsed, ...] = ()
    """Of a liquid ring: every physical term, with its model and its estimated contribution."""

    @property
    def settled(self) -> bool:
        """Whether every run settled."""
        return all(math.isfinite(result.time) for result in self.results)

    @property
    def time(self) -> float | None:
        """Median of all runs, s; None when fewer than half settled."""
        return finite(self.middle("time"))

    @property
    def status(self) -> str:
        """Of the first run that did not settle, else of the first."""
        return next((r for r in self.results if math.isinf(r.time)), self.results[0]).status

    @property
    def finding(self) -> Finding:
        """How its runs ended."""
        done = sum(math.isfinite(each.time) for each in self.results)
        numbers: dict[str, Value] = {"source": self.scene.source, "text": self.status}
        numbers |= {"settled": done, "runs": len(self.results)}
        return Finding(code="side_settled" if self.settled else "side_not_settled", values=numbers)

    @property
    def tuned_text(self) -> str:
        """What tuning has changed, as a scene file has it."""
        return (
            ", ".join(f"{key} {setting_text(key, value)}" for key, value in self.tuned.items()) or "as it is"
        )

    def quantities(self, prefix: str) -> tuple[Quantity, ...]:
        """Medians over its runs, from the smallest to the largest. Args: `prefix`: of the keys."""
        rows = []
        for name, (words, unit) in _WORDS.items():
            low, high = (finite(end) for end in self.ends(name))
            value = finite(self.middle(name))
            status = "ok" if value is not None else "not_settled"
            ends = (low, high) if low != high else (None, None)
            rows.append(
                Quantity(
                    key=prefix + name,
                    name=words,
                    unit=unit,
                    value=value,
                    lower=ends[0],
                    upper=ends[1],
                    origin="simulated",
                    status=status,
                )
            )
        return tuple(rows)

    def middle(self, name: str) -> float:
        """Median of one number of `_RunResult` over the runs."""
        return float(np.quantile(self._values(name), 0.5, method="inverted_cdf"))

    def ends(self, name: str) -> tuple[float, float]:
        """Smallest and largest of one number of `_RunResult` over the runs."""
        values = self._values(name)
        return min(values), max(values)

    def _values(self, name: str) -> list[float]:
        return [getattr(result, name) for result in self.results]


@dataclass(frozen=True, kw_only=True, repr=False)
class Comparison(Result):
    """Two balancers on one rotor."""

    rotor: CommonRotor
    """That of the first scene."""
    span: float
    """s, from the start of balancing, of every run: the longer time limit of both scenes."""
    sides: tuple[Side, Side]
    """In the order of the scenes."""

    def to_dict(self) -> dict[str, Any]:
        """All as a JSON document in SI; lists run along `scenes`; null: not settled."""
        sides, rotor = self.sides, self.rotor
        return {
            "scenes": [
                {"name": side.scene.name, "source": side.scene.source, "sha256": side.scene.sha256}
                for side in sides
            ],
            "balancer": [side.scene.balancer for side in sides],
            "settled": [side.settled for side in sides],
            "time_s": [side.time for side in sides],
            "residual_ratio": [side.middle("residual_ratio") for side in sides],
            "energy_J": [side.middle("energy") for side in sides],
            "worst_amplitude_m": [side.middle("worst_amplitude") for side in sides],
            "spread": [
                {key: [finite(end) for end in side.ends(name)] for key, name in _NUMBERS.items()}
                for side in sides
            ],
            "runs": [len(side.results) for side in sides],
            "runs_settled": [sum(math.isfinite(r.time) for r in side.results) for side in sides],
            "tuned": [dict(side.tuned) for side in sides],
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
        """What both come to: medians over the runs, with the smallest and the largest."""
        rotor, sides = self.rotor, self.sides
        of_rotor = (
            ("speed", "speed", "rad/s", rotor.speed),
            ("influence", "influence coefficient", "m/(kg m)", abs(rotor.influence)),
            ("lag_angle", "lag angle", "rad", -cmath.phase(rotor.influence)),
            ("initial_amplitude", "amplitude before balancing", "m", rotor.amplitude),
            ("limit", "limit", "m", rotor.limit),
            ("span", "time of each run", "s", self.span),
        )
        both = [side.quantities(f"{place}.") for place, side in enumerate(sides, start=1)]
        facts = ({"balancer": s.scene.balancer.replace("_", " "), "tuned": s.tuned_text} for s in sides)
        return Rows(
            title=f"Two balancers on the rotor of {rotor.source}",
            quantities=(
                *(Quantity(key=k, name=n, unit=u, value=v, origin="given") for k, n, u, v in of_rotor),
                *both[0],
                *both[1],
            ),
            listed=len(of_rotor),
            findings=tuple(side.finding for side in sides),
            tables=(_table(sides, both, tuple(facts)),),
        )


def compare(first: Balancer, second: Balancer, *, runs: int = RUNS) -> Comparison:
    """Put two balancers on the rotor of the first, tune each, and let each balance it over one span.

    Of the second its balancer alone counts.  Each has the settings that its formulas recommend.
    Raises: SceneError: a balancer that cannot work on that rotor.
    """
    rotor = vibrating(first.scene, first.rotor())
    try:
        # Whether the second can work there at all is known before anything is run.
        both = first.on_rotor(None), second.on_rotor(rotor)
        span = max(balancer.span() for balancer in both)
        one, other = (_side(rotor, balancer, span=span, runs=runs) for balancer in both)
    except SceneError as error:
        raise SceneError(_placed(first.scene, fault) for fault in error.faults) from error
    return Comparison(rotor=rotor, span=span, sides=(one, other))


def _placed(first: SceneFile, fault: Fault) -> Fault:
    if fault.file == first.file:
        return fault
    return replace(fault, problem=f"on the rotor of {first.source}: {fault.problem}")


def _side(rotor: CommonRotor, balancer: Balancer, *, span: float, runs: int) -> Side:
    advised, changes = balancer.advised()
    ready = advised.lasting(span)
    found = ready.run({}, Draws.first(runs, devices=False), trace=True)
    results = tuple(
        _RunResult(
            time=math.inf if each.settling_time is None else each.settling_time,
            residual_ratio=each.final_amplitude / rotor.amplitude,
            energy=each.energy,
            worst_amplitude=each.worst_amplitude,
            status=each.run.status,
        )
        for each in found.traced
    )
    return Side(scene=ready.scene, tuned=changes, results=results, models_used=ready.models_used)


_NUMBERS: Final = {
    "time_s": "time",
    "residual_ratio": "residual_ratio",
    "energy_J": "energy",
    "worst_amplitude_m": "worst_amplitude",
}
"""Keys of the document, each with its number of `_RunResult`."""
_WORDS: Final = {
    "time": ("time to the limit", "s"),
    "residual_ratio": ("left over, ratio", "1"),
    "energy": ("energy", "J"),
    "worst_amplitude": ("largest amplitude on the way", "m"),
}


def _table(
    sides: Sequence[Side], both: Sequence[Sequence[Quantity]], facts: Sequence[Mapping[str, str]]
) -> Table:
    """One column a balancer; medians with the smallest and the largest of the runs."""
    names = [side.scene.name for side in sides]
    heads = names if len(set(names)) > 1 else [side.scene.source for side in sides]
    rows = [(name, *(each[name] for each in facts)) for name in facts[0]]
    rows += [(one.name, one.text, other.text) for one, other in zip(*both, strict=True)]
    return Table(
        heads=("", *heads), rows=rows, note="medians of the runs; -/+: to the smallest and the largest"
    )
