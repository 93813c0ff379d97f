"""A section of the report: name, title, template, collected evidence and view."""

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
Document = Literal["report", "annex"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """Scene and level of effort that the sections' evidence is collected for."""

    scene: AnyScene
    level: Level

    @property
    def ring(self) -> Scene:
        """The scene, of a liquid ring. Raises: SceneError: another balancer."""
        return liquid_ring_scene(self.scene)

    @property
    def calibration(self) -> Calibration:
        """Calibration of a liquid ring, made once in a process. Raises: SceneError: another balancer."""
        return calibration_of(self.ring)


_WITH_LIQUID: Final = MappingProxyType({"liquid_ring": liquid_ring_scene})


def ring_of(scene: AnyScene) -> Scene | None:
    """The scene if its balancer has a calibration, fields and pictures (a liquid ring); else None."""
    narrowed = _WITH_LIQUID.get(scene.balancer)
    return None if narrowed is None else narrowed(scene)


def _nothing(_work: Work) -> None:
    """Collect no evidence."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section of the page."""

    name: str
    """Id on the page, key in the evidence, and stem of the template."""
    title: str
    document: Document = "annex"
    of_paper: bool = False
    """True if it stands in the annex of every scene but the paper's own."""
    collect: Callable[..., Record | None] = _nothing
    """Function of the work and the answers of `parts`: plain numbers and texts for the evidence, under the
    section's name; None: nothing to report."""
    parts: tuple[Job, ...] = ()
    """Jobs; each takes the work, then the answers that it needs."""
    show: Callable[[Record, Record], Record | None] = lambda _own, _evidence: {}
    """Function of the section's and the whole evidence: texts and drawings for the template, or None."""
    always: bool = False
    """True if the section is shown even without evidence, then with an empty record."""
    template: str = ""
    """File in `templates`, or "package:file" of another package; empty: the one of the section's name."""

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
        """Texts and figures for the template; None: the evidence has nothing for it."""
        record = evidence.get(self.name)
        if not record and not self.always and self.collect is not _nothing:
            return None
        return self.show(record or {}, evidence)
