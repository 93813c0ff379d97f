"""Flow inside the tube, drawn: the secondary flow of its turning section, its entrance and its exit."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.physics.tube.loss import FlowState, tube_loss
from ringbalance.reports.figures.tube_flow import end_figure, section_figure
from ringbalance.reports.numbers import number
from ringbalance.reports.pages.cases import anchor, case_view
from ringbalance.reports.section import Record, Section, Work
from ringbalance.verification.navier_stokes.flow_fields import (
    EndFlow,
    SectionFlow,
    entrance_flow,
    exit_flow,
    section_flow,
)

_LARGEST: Final = 500.0
"""Re up to which a flow is drawn: beyond, a laminar one is thin layers that no picture shows."""
_CHECK: Final = "bent_tube_3d"
_DIGITS: Final = 4


def collect(work: Work) -> Record | None:
    """Laminar flow fields at the operating point, or at the nearest one that can be drawn.

    Args: `work`: scene, calibration and level.
    Returns: Record; None where nothing flows.
    """
    scene, speed = work.scene, work.calibration.operating_point.loss_velocity
    if not speed:
        return None
    loss = tube_loss(
        tube=scene.tube,
        liquid=scene.liquid,
        angular_velocity=scene.rotor.speed,
        velocity=speed,
        inputs=scene.uncertainty,
    )
    reynolds = float(loss.reynolds)
    drawn = min(reynolds, _LARGEST)
    rotation = loss.rotation_reynolds * drawn / reynolds
    return {
        "reynolds": reynolds,
        "rotation_reynolds": loss.rotation_reynolds,
        "laminar": bool(loss.flow_state == FlowState.LAMINAR),
        "section": _section_record(section_flow(reynolds=drawn, rotation_reynolds=rotation)),
        "entrance": _end_record(entrance_flow(reynolds=drawn)),
        "exit": _end_record(exit_flow(reynolds=drawn)),
    }


def packed(values: npt.ArrayLike) -> str:
    """Numbers as one line of text: a field of a thousand nodes is nothing to read number by number.

    Args: `values`: any shape; written flat.
    Returns: Text, four significant digits.
    """
    return " ".join(f"{value:.{_DIGITS}g}" for value in np.asarray(values).ravel())


def _section_record(flow: SectionFlow) -> Record:
    return {
        "reynolds": flow.reynolds,
        "rotation_reynolds": flow.rotation_reynolds,
        "friction_ratio": flow.friction_ratio,
        "points": packed(flow.points),
        "triangles": " ".join(str(node) for node in flow.triangles.ravel()),
        "colour": packed(flow.axial_velocity),
        "stream_function": packed(flow.stream_function),
        "velocity": packed(flow.velocity),
    }


def _end_record(flow: EndFlow) -> Record:
    return {
        "reynolds": flow.reynolds,
        "points": packed(flow.points),
        "triangles": " ".join(str(node) for node in flow.triangles.ravel()),
        "colour": packed(flow.speed),
        "stream_function": packed(flow.stream_function),
    }


def view(evidence: Record) -> Record | None:
    """The section's texts and figures.

    Args: `evidence`: the whole document.
    Returns: Record; None where the evidence has none of it.
    """
    found = evidence.get("inside")
    if not found:
        return None
    return {
        "lead": _lead(found),
        "section": section_figure(found["section"]),
        "ends": [end_figure(found[name], name) for name in ("entrance", "exit")],
        "check": three_dimensional_check(evidence),
    }


def _lead(found: Record) -> str:
    asked, drawn = found["reynolds"], found["section"]["reynolds"]
    told = f"At the operating point Re is {number(asked, digits=3)} and ωd²/ν {_rotation(found)}"
    if found["laminar"] and drawn > 0.999 * asked:
        return f"{told}: laminar, and drawn as it is."
    why = "so fast a laminar flow is thin layers" if found["laminar"] else "there the flow is not laminar"
    return (
        f"{told}; {why}. Drawn is laminar flow at Re {number(drawn, digits=3)} with the same ratio of "
        "ωd²/ν to Re: the pattern, not the flow of this tube."
    )


def _rotation(found: Record) -> str:
    return number(found["rotation_reynolds"], digits=3)


def three_dimensional_check(evidence: Record) -> Record | None:
    """The bent tube solved in three dimensions, against the sum of the terms of k: run when, on what, how.

    Args: `evidence`: the whole document.
    Returns: Verdict, texts and the place of the case on the page; None where there is no such case.
    """
    cases = [case for case in evidence["verification"] if case["id"] == _CHECK]
    if not cases:
        return None
    case: dict[str, Any] = cases[0]
    shown_case = case_view(case)
    run = case["verdict"] != "not run"
    digest = case.get("scene_sha256") or ""
    return {
        "verdict": case["verdict"],
        "anchor": anchor(case),
        "title": shown_case["title"],
        "rows": shown_case["rows"] if run else [],
        "when": case.get("date") or (evidence["times"]["date"] if run else ""),
        "hash": digest[:12] if run else "",
        "why_not_run": shown_case["why_not_run"],
    }


SECTION: Final = Section(name="inside", title="Flow inside the tube", collect=collect, view=view)
