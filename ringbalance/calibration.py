"""Calibration and the paper's law for Python, without loading the closed loop."""

from __future__ import annotations

from ringbalance.interface import checked
from ringbalance.reduced_model.calibration import calibrate as calibrate_scene
from ringbalance.reduced_model.calibration_record import Calibration
from ringbalance.reduced_model.law.paper_law import PaperLaw
from ringbalance.reduced_model.law.paper_law import paper_law as paper_law_of
from ringbalance.scene.narrowing import AnyScene


@checked
def calibrate(scene: AnyScene) -> Calibration:
    """Calibrate a scene's balancer: lambda, k(u) and the flow law, with uncertainties.

    Raises: SceneError: a rotor too slow for the liquid to form a ring, or a balancer without liquid.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> calibration = rb.calibrate(scene)
        >>> flow = calibration.flow_law.evaluate(fill_ratio=0.25, gas_pressure=0.7e6)
        >>> f"{flow.velocity:.1f} m/s"
        '14.9 m/s'
    """
    return calibrate_scene(scene)


@checked
def paper_law(scene: AnyScene) -> PaperLaw:
    """The paper's flow law for a scene, with k = 50 unless the scene fixes it.

    Raises: SceneError: a balancer without liquid.

    Example:
        >>> scene = rb.load_scene(rb.bundled_scene("liquid_ring_paper"))
        >>> law = rb.paper_law(scene)
        >>> f"{law.evaluate(fill_ratio=0.25, gas_pressure=0.7e6).velocity:.2f} m/s"
        '5.24 m/s'
    """
    return paper_law_of(scene)
