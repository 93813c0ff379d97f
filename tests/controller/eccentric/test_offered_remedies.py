"""Remedies as changes of the scene that are tried."""

from __future__ import annotations

from eccentric_runs import bundled

from ringbalance.controller.balancer import Draws, balancer_of


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
