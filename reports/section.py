"""What a section of the report is: a name, a title, a template, and what it collects and shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from ringbalance.reduced_model.calibration import Calibration
from ringbalance.scene import Scene

Record = dict[str, Any]
Level = Literal["light", "heavy"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Work:
    """What a section's evidence is collected from."""

    scene: Scene
    calibration: Calibration
    level: Level


def nothing(_work: Work) -> None:
    """Collects no evidence of its own."""


def everything(_evidence: Record) -> Record:
    """Needs nothing but what every template sees."""
    return {}


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section of the page."""

    name: str
    """Its id on the page, its key in the evidence, and the stem of its template."""
    title: str
    """In the contents."""
    collect: Callable[[Work], Record | None] = nothing
    """Plain numbers and texts for the evidence, under the section's name; None: nothing there."""
    last: bool = False
    """Whether it is collected after the cases have run, which then have compiled what it needs."""
    view: Callable[[Record], Record | None] = everything
    """From the whole evidence to what the template calls `view`: texts, `Drawing`s; None: no such section."""

    @property
    def template(self) -> str:
        """File in `templates`."""
        return f"{self.name}.html"
