"""What a section of the report is: a name, a title, a template, and what it collects and shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Final, Literal

from ringbalance.controller.tuning.result import Tuning
from ringbalance.controller.tuning.tune import tune
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.scene import Scene
from ringbalance.verification.evidence import Level
from ringbalance.verification.loops import calibration_of

Record = dict[str, Any]
_TUNING_RUNS: Final = 500
_TERM_RUNS: Final = 10
Place = Literal["report", "annex"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """What a section's evidence is collected from."""

    scene: Scene
    calibration: Calibration
    level: Level

    @cached_property
    def tuning(self) -> Tuning:
        """The recommended gain of the scene's controller under the calibrated law."""
        return _tuning_of(self.scene)


@lru_cache(maxsize=4)
def _tuning_of(scene: Scene) -> Tuning:
    """One tuning serves every report of a scene within a process."""
    return tune(scene, calibration_of(scene).model, members=_TUNING_RUNS, runs=_TERM_RUNS)


def _nothing(_work: Work) -> None:
    """Collects no evidence of its own."""


def _everything(_own: Record, _evidence: Record) -> Record:
    """Shows nothing but what every template sees."""
    return {}


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section of the page."""

    name: str
    """Its id on the page, its key in the evidence, and the stem of its template."""
    title: str
    """In the contents."""
    place: Place = "annex"
    """Which of the two documents it stands in."""
    of_paper: bool = False
    """Whether it stands in the annex of every scene but the paper's own."""
    collect: Callable[[Work], Record | None] = _nothing
    """Plain numbers and texts for the evidence, under the section's name; None: nothing there."""
    apart: bool = False
    """Whether a worker may collect it, after the cases: it takes long, and all it needs is compiled then."""
    show: Callable[[Record, Record], Record | None] = _everything
    """From its own evidence and the whole to what the template calls `view`: texts, `Drawing`s, or None."""
    always: bool = False
    """Whether it is shown without evidence of its own, which is then empty."""
    template: str = ""
    """File in `templates`; by default that of its name."""

    @property
    def file(self) -> str:
        """File in `templates`."""
        return self.template or f"{self.name}.html"

    def view(self, evidence: Record) -> Record | None:
        """What the template shows of the whole evidence; None: no such section."""
        own = evidence.get(self.name)
        if not own and not self.always and self.collect is not _nothing:
            return None
        return self.show(own or {}, evidence)
