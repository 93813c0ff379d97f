"""What kind of thing a drawn input is: spread from device to device, or one value that is not known.

Where all devices have a value alike, a fraction of drawn devices is the probability that the design conforms
(JCGM 106:2012, section 9), and not the yield of a production.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ringbalance.scene.kinds import scene_kind
from ringbalance.scene.origins import SceneFile

MEASURE_INPUT: Final = "measure_input"


@dataclass(frozen=True, kw_only=True)
class DrawnInput:
    """A drawn input."""

    common: bool
    """Whether all devices have it alike, so that it is merely not known; else it varies between them."""
    measure: str
    """Code of the finding that says what to measure to know it better; empty: nothing can be measured."""
    path: str = ""
    """Of its key in the scene; empty: the scene has none."""


def drawn_key(scene: SceneFile, path: str) -> DrawnInput:
    """An input of a scene by its path, such as "rotor.mass", which is measured as it is."""
    table, _, key = path.split("[")[0].partition(".")
    declared = scene_kind(scene.balancer).schema.key_at((table, key))
    return DrawnInput(common=declared.common, measure=MEASURE_INPUT, path=path)
