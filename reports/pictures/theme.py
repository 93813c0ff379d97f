"""Colours of the 3-D pictures, one set for a light page and one for a dark page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

PICTURE: Final = (1500, 1000)
"""Pixels of a finished picture."""


@dataclass(frozen=True, kw_only=True)
class Theme:
    """Colours of a picture, so that it sits on the page without a frame."""

    name: str
    background: str
    ink: str
    metal: str
    tube: str
    mark: str
    edge: str


THEMES: Final = (
    Theme(
        name="light",
        background="#ffffff",
        ink="#1d2530",
        metal="#c3cad2",
        tube="#c2661c",
        mark="#1d2530",
        edge="#5b6675",
    ),
    Theme(
        name="dark",
        background="#12171e",
        ink="#e4e8ee",
        metal="#66717e",
        tube="#ffa35c",
        mark="#ffffff",
        edge="#9aa6b5",
    ),
)
