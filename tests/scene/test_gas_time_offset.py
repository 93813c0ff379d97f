"""One offset for all valves, or one for each chamber."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest

from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene

Load = Callable[[Mapping[str, Any]], Scene]


@pytest.mark.parametrize(
    ("written", "offsets"),
    [("30 ms", (0.03,) * 4), (["10 ms", "20 ms", "0.03 s", "0 s"], (0.01, 0.02, 0.03, 0.0))],
)
def test_one_for_all_or_one_for_each(
    paper_document: dict[str, Any], load: Load, written: Any, offsets: tuple[float, ...]
) -> None:
    paper_document["controller"]["gas_time_offset"] = written
    assert load(paper_document).controller.offsets(4) == pytest.approx(offsets)


@pytest.mark.parametrize(
    ("written", "problem", "allowed"),
    [
        (["30 ms"] * 3, "3 times for 4 chambers", "a list of 4"),
        (["-1 ms"] * 4, "entry 1", "a time of at least 0"),
        ("-1 ms", "at least 0", "a time of at least 0"),
    ],
)
def test_other_offsets_are_one_error(
    paper_document: dict[str, Any], load: Load, written: Any, problem: str, allowed: str
) -> None:
    paper_document["controller"]["gas_time_offset"] = written
    with pytest.raises(SceneError) as caught:
        load(paper_document)
    (fault,) = caught.value.faults
    assert (fault.table, fault.key) == ("controller", "gas_time_offset")
    assert problem in fault.problem
    assert allowed in fault.allowed
