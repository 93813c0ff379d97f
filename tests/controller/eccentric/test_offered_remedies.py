"""Remedies that runs advise, as changes that are tried: none undoes another."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from eccentric_runs import bundled

from ringbalance.controller.balancer import Draws, balancer_of
from ringbalance.controller.eccentric_mass.remedies import advised_remedies
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


def test_masses_too_light_are_made_heavy_enough() -> None:
    """7 g cancel 700 of 926 g mm; the remedy, applied and run on devices that did not size it, settles."""
    light = bundled("driven_masses_small").with_values({"masses.mass": "7 g", "run.time_limit": "12 s"})
    found = balancer_of(light).remedies()
    assert {"mass", "guide_radius"} <= {each.code for each in found}
    mended = balancer_of(light.with_values(found[0].changes))
    assert mended.run({}, Draws.block(1 << 22, 3)).settled.all()


def test_a_residual_below_the_limit_lowers_it() -> None:
    scene = bundled("driven_masses_small").with_values({"run.time_limit": "4 s"})
    required = scene.with_values({"requirement.residual": "0.02 um"})
    limits = [each.changes for each in balancer_of(required).remedies() if each.code == "limit"]
    assert limits == [{"supervisor.limit": 2e-8}]
