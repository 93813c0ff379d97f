"""What `tune` answers with: settings chosen by runs of few drawn devices, judged on others."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ringbalance.controller.judging.judge import Judgement
from ringbalance.controller.judging.ranking import Ranking
from ringbalance.controller.judging.remedies import Remedied
from ringbalance.controller.judging.search import Along
from ringbalance.controller.trials import Information
from ringbalance.results.requirements import MET
from ringbalance.results.result import PresentedResult
from ringbalance.scene.changes import rechecked
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.origins import SceneFile, with_values_at


@dataclass(frozen=True, kw_only=True, eq=False)
class BestOfKind:
    """The best settings of one kind of controller, on the devices of the search."""

    kind: str
    judgement: Judgement


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class Tuning(PresentedResult):
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
