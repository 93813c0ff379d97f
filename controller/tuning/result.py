"""What is recommended for a liquid ring's controller."""

from __future__ import annotations

from dataclasses import dataclass

from ringbalance.controller.tuning.loop_factor import LoopFactor, Margins
from ringbalance.controller.tuning.recommendation import Contribution
from ringbalance.controller.tuning.search import Search
from ringbalance.controller.tuning.settling import SettlingTimes
from ringbalance.reduced_model.gas_line import LineAnswer
from ringbalance.reduced_model.terms import ModelUsed
from ringbalance.results.result import PresentedResult
from ringbalance.scene.changes import rechecked
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene


@dataclass(frozen=True, kw_only=True, repr=False)
class Tuning(PresentedResult):
    """What is recommended for a scene's controller under a law."""

    scene: Scene
    """With what is recommended."""
    law: str
    gain: float | None
    """Kc, s/m; None for an algorithm without a gain, and where no gain reaches the limit."""
    present: LoopFactor
    """With the scene's own gain."""
    loop: LoopFactor
    """With the recommended one."""
    margins: Margins | None
    contributions: tuple[Contribution, ...]
    first_gas_time: float | None
    """s, of the vector, for the initial vibration."""
    last_gas_time: float | None
    """s, for an amplitude at the limit."""
    smallest_correction: float
    """Change of the vibration by the shortest valve-open time in the fastest chamber, m."""
    dead_times: tuple[float, ...]
    """s, of every chamber; empty where runs do not model the filling of gas."""
    dead_zone: float
    """Largest amplitude at which no valve may open any more, or none transfers liquid, m."""
    change: str
    """Keys and values that are recommended beside the gain; empty: none."""
    search: Search | None
    """What was tried because the runs under the first recommendation do not settle; None: they do."""
    beyond_capacity: float
    """Vibration that remains with the liquid at its best, m."""
    reachable: bool | None
    """Whether valves and gas line can bring the amplitude below the limit; None: the line is not known."""
    gas_line: tuple[LineAnswer, ...]
    """What the gas line can deliver, or both ends of a default range of lines."""
    settling: SettlingTimes | None
    models_used: tuple[ModelUsed, ...]
    status: str

    @property
    def recommended_scene(self) -> AnyScene:
        """The scene with what is recommended, checked, with a hash of its own."""
        return rechecked(self.scene)

    @property
    def succeeded(self) -> bool:
        """Whether 95 % of the runs settle in time, and nothing that is known stands against it."""
        reached = self.settling is not None and self.settling.quantiles["p95"] is not None
        return reached and self.reachable is not False
