"""Remedies that runs advise, as changes that are tried: none undoes another."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from eccentric_runs import bundled

from ringbalance.controller.balancer import balancer_of
from ringbalance.controller.eccentric_mass.balancer import advised_remedies
from ringbalance.results.rows import Finding


def run(*changes: Mapping[str, float | str]) -> Any:
    advice = tuple(Finding(code="masses_remedy", values={"text": ""}, change=each) for each in changes)
    return SimpleNamespace(remedies=advice)


def test_the_most_advised_comes_first_and_none_turns_another_back() -> None:
    scene = bundled("driven_masses_small")
    gain, limit = scene.friction_filter.speed_gain, scene.supervisor.limit
    stronger, weaker = ({"friction_filter.speed_gain": factor * gain} for factor in (2.0, 0.5))
    wider, widest = ({"supervisor.limit": factor * limit} for factor in (2.0, 3.0))
    exact = {"imbalance_filter.discretisation": "exact"}
    runs = [run(wider, stronger), run(widest, stronger), run(weaker), run(wider, exact)]
    found = advised_remedies(scene, runs)
    assert [each.changes for each in found] == [widest, stronger, exact]


def test_a_run_that_ends_too_early_advises_more_time() -> None:
    short = bundled("driven_masses_small").with_values({"run.time_limit": "3 s"})
    found = balancer_of(short).remedies()
    assert "run.time_limit" in found[0].changes
    short.with_values(found[0].changes)
