"""Frames and time spans of the figures of a ring's loop."""

from __future__ import annotations

from typing import Any

import pytest

from ringbalance.reports.pages.loop import _frames_of, _injections_until

RUN: dict[str, Any] = {
    "time_s": [0.0, 1.0, 30.0],
    "injections": [
        {"time_s": 0.0, "duration_s": 0.4, "chamber": "C"},
        {"time_s": 0.0, "duration_s": 0.1, "chamber": "B"},
        {"time_s": 2.0, "duration_s": 0.1, "chamber": "A"},
    ],
}


def test_injections_that_begin_together_are_one_frame_at_rest_before_the_next() -> None:
    """Liquid flows on after a valve has closed, at 0.4 s and 2.1 s."""
    assert [(title.split(",")[0], time) for title, time in _frames_of(RUN)] == [
        ("start", 0.0),
        ("B and C", 2.0),
        ("A", 30.0),
        ("end", 30.0),
    ]
    assert _injections_until(RUN) == pytest.approx(2.1)
