"""What a section of the report is: a name, a title, a template, and what it collects and shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any, Final, Literal

from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.scene import AnyScene, Scene, liquid_ring_scene
from ringbalance.scene.platform.jobs import Job
from ringbalance.verification.evidence import Level
from ringbalance.verification.loops import calibration_of

Record = dict[str, Any]
Place = Literal["report", "annex"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """What a section's evidence is collected from."""

    scene: AnyScene
    level: Level

    @property
    def ring(self) -> Scene:
        """The scene, of a liquid ring. Raises: SceneError: another balancer."""
        return liquid_ring_scene(self.scene)

    @property
    def calibration(self) -> Calibration:
        """Of a liquid ring, made once in a process."""
        return calibration_of(self.ring)


_WITH_LIQUID: Final = MappingProxyType({"liquid_ring": liquid_ring_scene})


def ring_of(scene: AnyScene) -> Scene | None:
    """The scene, of a balancer whose report calibrates and has fields and pictures; else None."""
    narrowed = _WITH_LIQUID.get(scene.balancer)
    return None if narrowed is None else narrowed(scene)


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
    collect: Callable[..., Record | None] = _nothing
    """From the work and the answers of `parts`: plain numbers and texts for the evidence, under the section's
    name; None: nothing there."""
    parts: tuple[Job, ...] = ()
    """Jobs that take the work, and then what they need."""
    show: Callable[[Record, Record], Record | None] = _everything
    """From its own evidence and the whole to what the template calls `view`: texts, `Drawing`s, or None."""
    always: bool = False
    """Whether it is shown without evidence of its own, which is then empty."""
    template: str = ""
    """File in `templates`; by default that of its name."""

    def jobs(self, work: Work) -> list[Job]:
        """Jobs that collect its evidence, the last under its own name; none where it collects nothing."""
        if self.collect is _nothing:
            return []
        needs = tuple(part.name for part in self.parts)
        last = Job(name=self.name, title=self.title, needs=needs, do=self.collect)
        return [replace(job, do=partial(job.do, work)) for job in (*self.parts, last)]

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
