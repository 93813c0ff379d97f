"""Calibration of a scene: lambda, k(u) and the flow law, each with its uncertainty budget."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.physics.tube.loss import VELOCITIES, tube_loss
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.chamber.calibration import ChamberCalibration, calibrate_chamber
from ringbalance.reduced_model.chamber.contributions import AsynchronousInstability
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.core import Answers
from ringbalance.reduced_model.documents import calibration_document, calibration_rows
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.files import load_law
from ringbalance.reduced_model.law.flow_law import CALIBRATED, UNCHECKED, BalancerModel
from ringbalance.reduced_model.law.making import calibrated_law
from ringbalance.reduced_model.law.paper_law import paper_law, paper_model
from ringbalance.reduced_model.terms import models_used
from ringbalance.reduced_model.tube.flow import TubeFlow
from ringbalance.reduced_model.tube.heads import TubeHeads
from ringbalance.results.result import Presentation
from ringbalance.scene.designs import Designs
from ringbalance.scene.models import Scene
from ringbalance.scene.narrowing import AnyScene, liquid_ring_scene

_VELOCITY_POINTS: Final = 47


def calibrate(scene: AnyScene) -> Calibration:
    """Calibrate a scene's balancer: lambda, k(u) and the flow law, with uncertainties.

    Raises: SceneError: a rotor too slow for the liquid to form a ring, or a balancer without liquid.
    Raises: ValueError: a tube whose bends do not fit into its length.
    Source: closed forms for the chamber, checked by finite elements; tables of finite elements for the
        laminar tube, correlations beyond; see the parts.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> calibration = rb.calibrate(scene)
        >>> flow = calibration.flow_law.evaluate(fill_ratio=0.25, gas_pressure=0.7e6)
        >>> f"{flow.velocity:.1f} m/s"
        '14.9 m/s'
    """
    scene = liquid_ring_scene(scene)
    chamber, law = known_chamber_and_law(scene)
    heads = law.heads
    return Calibration(
        presentation=Presentation(document=calibration_document, rows=calibration_rows),
        scene=scene,
        chamber=chamber,
        tube=tube_loss(scene, np.geomspace(*VELOCITIES, _VELOCITY_POINTS)),
        flow_law=law,
        paper_law=paper_law(scene),
        answers=_answers(scene, chamber),
        instability=AsynchronousInstability.of(scene),
        models_used=models_used(scene),
        statistics={
            "closed_form_fills": float(np.count_nonzero(chamber.fill_ratio)),
            "finite_element_solves": float(chamber.check.solves),
            "unknowns": float(chamber.statistics.unknowns),
            "relative_residual": chamber.statistics.relative_residual,
            "tube_table_nodes": float(heads.siphon.knots.size),
            "tube_table_error": heads.interpolation_error,
            "wall_pressure_table_error_Pa": float(np.max(chamber.wall_pressure.interpolation)),
            "hydrostatic_pressure_table_error_Pa": float(np.max(chamber.hydrostatic_pressure.interpolation)),
            "moment_table_error_kg_m": float(np.max(chamber.moment.interpolation)),
        },
    )


def _answers(scene: Scene, chamber: ChamberCalibration) -> Answers:
    """Answers for one scene as scalars, from the tables of its chamber, which include gravity."""
    tube = TubeFlow.of(Designs.stacked([scene]), curve=chamber.hydrostatic_pressure.table.quintic)
    answers = Answers.of_tubes(tube, moments=chamber.moment.table.quintic)
    row = {name: values[0] for name, values in vars(answers).items()}
    row["wall_pressure"] = chamber.wall_pressure.value[chamber.reported[-1]]
    row["moment_per_mass"] = chamber.moment_per_mass.value[()]
    return Answers(**row)


def calibrated_model(scene: Scene, *, checked: bool = True, varied: bool = True) -> BalancerModel:
    """Balancer model of `calibrate` without the rest of its report, at half the cost.

    Args: `checked`: true if finite elements check the chamber, half of the remaining cost.
        `varied`: true if the law carries the effects of the scene's uncertain inputs, half of what then
        remains.
    Raises: SceneError, ValueError: as `calibrate`.
    """
    return BalancerModel.of(known_chamber_and_law(scene, checked=checked, varied=varied)[1])


def law_by_name(scene: Scene, law: str) -> BalancerModel:
    """Model of a scene under the law "calibrated", `UNCHECKED`, "paper", or that of a saved file.

    Raises: SceneError: a scene that cannot be calibrated, or a file that holds no law.
    """
    if law in (CALIBRATED, UNCHECKED):
        return calibrated_model(scene, checked=law == CALIBRATED, varied=law == CALIBRATED)
    return paper_model(scene) if law == "paper" else BalancerModel.of(load_law(Path(law)))


def chamber_and_law(
    scene: Scene, *, checked: bool = True, varied: bool = True
) -> tuple[ChamberCalibration, CalibratedLaw]:
    """Calibrated chamber and flow law of a scene. Args: as `calibrated_model`.

    Raises: SceneError, ValueError: as `calibrate`.
    """
    check_ring(scene)
    chamber = calibrate_chamber(scene, checked=checked, varied=varied)
    return chamber, calibrated_law(scene=scene, chamber=chamber, heads=TubeHeads.of(scene), varied=varied)


known_chamber_and_law = lru_cache(maxsize=16)(chamber_and_law)
"""`chamber_and_law`, cached for the last 16 calls."""
