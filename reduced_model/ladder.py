"""Which model serves each physical term of a scene, why, and what the term is worth.

Every term has rungs from free to dear.  A dimensionless estimate of its contribution, held against the
scene's tolerance, picks the cheapest rung that will do; a term above the tolerance for which this version has
no rung says so plainly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringbalance.mesh.geometry import chamber_volume
from ringbalance.reduced_model import paper
from ringbalance.reduced_model.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.chamber_calibration import ChamberCalibration
from ringbalance.reduced_model.chamber_terms import amplification, capillary_share
from ringbalance.reduced_model.gravity import gravity_ratio
from ringbalance.reduced_model.operating_point import OperatingPoint
from ringbalance.reduced_model.transients import (
    filling_time,
    inertia_time,
    pulse_time,
    tube_liquid_share,
)
from ringbalance.scene.models import Scene

LEFT_OUT = "left out"
NOT_MODELLED = "not modelled in this version"
IN_THE_LOOP = "modelled by `ringbalance simulate`, beside the quasi-steady law given here"


@dataclass(frozen=True, kw_only=True)
class Term:
    """One physical term of a scene."""

    term: str
    model: str
    """The rung used, "left out", or "not modelled in this version"."""
    why: str
    """Reason and formula."""
    estimated_contribution: float | None
    """Relative, before solving; None where the scene gives no basis for an estimate."""


def models_used(
    *, scene: Scene, chamber: ChamberCalibration, law: CalibratedLaw, point: OperatingPoint
) -> tuple[Term, ...]:
    """Choose a rung for every term and say why.

    Args:
        scene: the scene.
        chamber: its calibrated chamber.
        law: its flow law.
        point: its operating point.

    Returns:
        Terms, those of the chamber first.

    Source: the formula stands in each term's `why`.
    """
    return (
        _plates(scene),
        _gravity(scene, chamber),
        _sloshing(scene),
        *_unmodelled(scene),
        _hump(scene, law, point),
        _friction(scene, point),
        _rotation(scene, point),
        *_transients(scene, law, point),
    )


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"


def _judged(scene: Scene, share: float | None) -> str:
    """Model of a term that has no rung but leaving it out."""
    return NOT_MODELLED if share is not None and share > scene.tolerance else LEFT_OUT


def _against(scene: Scene, share: float | None) -> str:
    if share is None:
        return "the scene gives no basis for an estimate"
    side = "above" if share > scene.tolerance else "below"
    return f"{_percent(share)} is {side} the tolerance of {_percent(scene.tolerance)}"


def _plates(scene: Scene) -> Term:
    strips = paper.chamber_volume_paper(disc=scene.disc)
    bare = paper.sector_area(disc=scene.disc) * scene.disc.axial_width
    exact = chamber_volume(disc=scene.disc)
    return Term(
        term="plates between the chambers",
        model="exact geometry",
        why=(
            f"costs nothing; flat strips would be {_percent(abs(strips / exact - 1))} off in volume, "
            "leaving the plates out as much as the contribution says: 1 - V/(B theta (R2^2 - R1^2)/2)"
        ),
        estimated_contribution=1 - exact / bare,
    )


def _gravity(scene: Scene, chamber: ChamberCalibration) -> Term:
    share = chamber.gravity_share
    held = "quasi-static, free surface found, mean over a turn" if chamber.gravity_modelled else LEFT_OUT
    return Term(
        term="gravity, mean over a turn",
        model=held,
        why=(
            f"second order in g/(omega^2 a) at equal fills; {_against(scene, share)}; {chamber.gravity_check}"
        ),
        estimated_contribution=share,
    )


def _sloshing(scene: Scene) -> Term:
    if scene.environment.shaft == "vertical":
        return Term(
            term="gravity ripple at 1x and sloshing",
            model=LEFT_OUT,
            why="on a vertical shaft gravity does not turn in the disc's frame",
            estimated_contribution=0.0,
        )
    ripple, swing = gravity_ratio(scene), amplification(scene, scene.disc.max_fill_ratio / 2)
    share = ripple * (1 + 2 * max(swing, 1.0))
    above = share > scene.tolerance
    return Term(
        term="gravity ripple at 1x and sloshing",
        model="apart, by `ringbalance trade`; the means given here do not hold it" if above else LEFT_OUT,
        why=(
            f"tilt g/(omega^2 a) = {_percent(ripple)}, which the liquid's swing at 1x makes "
            f"n = |1/(1 - 1/s^2)| = {swing:.2g} times as large in the moment and about 1 + 2 max(1, n) times "
            f"in the wall pressure, at every speed; {_against(scene, share)}; "
            "it vanishes in the mean over a turn"
        ),
        estimated_contribution=share,
    )


def _unmodelled(scene: Scene) -> tuple[Term, ...]:
    """What no rung holds: surface tension, and the layers at the walls of a chamber."""
    x = np.array([scene.disc.max_fill_ratio / 2])
    capillary = capillary_share(scene, x)["pressures"]
    omega = abs(scene.rotor.speed)
    ekman = scene.liquid.kinematic_viscosity / (omega * scene.disc.outer_radius**2)
    layers = gravity_ratio(scene) * ekman**0.5 if scene.environment.shaft == "horizontal" else 0.0
    return (
        Term(
            term="surface tension",
            model=_judged(scene, capillary),
            why=f"sigma (2/B + 1/(a alpha) + 1/a)/P, an inverse Bond number; {_against(scene, capillary)}",
            estimated_contribution=capillary,
        ),
        Term(
            term="friction at the walls of a chamber",
            model=_judged(scene, layers),
            why=f"g/(omega^2 a) sqrt(Ek), Ek = nu/(omega R2^2) = {ekman:.1e}; {_against(scene, layers)}",
            estimated_contribution=layers,
        ),
    )


def _hump(scene: Scene, law: CalibratedLaw, point: OperatingPoint) -> Term:
    if law.path.hump_pressure is None:
        return Term(
            term="priming over the hump",
            model="always a full siphon",
            why="the scene gives no hump_radius: Eq. 18 as it stands",
            estimated_contribution=None,
        )
    return Term(
        term="priming over the hump",
        model=f"four regimes, hump gas {scene.tube.hump_gas}",
        why=(
            "column to the hump over the gas pressure, (omega^2/2) rho (R2^2 - r_m^2)/p; "
            "vented or trapped moves the threshold by up to "
            f"{float(law.wall_pressure(point.fill_ratio)) / 1e6:.3g} MPa"
        ),
        estimated_contribution=law.path.hump_pressure / scene.gas.pressure if scene.gas.pressure else None,
    )


def _friction(scene: Scene, point: OperatingPoint) -> Term:
    if scene.tube.drag_coefficient is not None:
        model, why = "k by decree", "the scene fixes drag_coefficient"
    else:
        model = "k(u): finite elements laminar, correlations turbulent"
        why = "against the liquid-ring paper's constant k = 50: relative change of the velocity"
    share = None if point.k is None else abs(((paper.PAPER_DRAG_COEFFICIENT + 1) / (point.k + 1)) ** 0.5 - 1)
    return Term(term="loss of the tube", model=model, why=why, estimated_contribution=share)


def _rotation(scene: Scene, point: OperatingPoint) -> Term:
    extra = point.k_parts.get("rotation")
    if extra is None or point.k is None:
        return Term(
            term="friction by rotation",
            model=LEFT_OUT,
            why="k is fixed by decree" if scene.tube.drag_coefficient is not None else "nothing flows",
            estimated_contribution=None,
        )
    return Term(
        term="friction by rotation",
        model="finite-element table laminar, correlation turbulent",
        why="half the rotation's share of k + 1 at the operating point: its effect on the velocity",
        estimated_contribution=abs(extra) / (point.k + 1) / 2,
    )


def _transients(scene: Scene, law: CalibratedLaw, point: OperatingPoint) -> tuple[Term, ...]:
    pulse = pulse_time(scene)
    start, filling = inertia_time(scene=scene, point=point), filling_time(scene=scene, law=law)
    lag, held = scene.gas.valve_lag, tube_liquid_share(scene=scene, law=law)

    def timed(term: str, time: float | None, formula: str) -> Term:
        share = None if time is None else time / pulse
        told = "" if time is None else f" of {1e3 * time:.3g} ms in a gas time of {1e3 * pulse:.3g} ms"
        above = share is not None and share > scene.tolerance
        return Term(
            term=term,
            model=IN_THE_LOOP if above else LEFT_OUT,
            why=f"{formula}{told}; {_against(scene, share)}",
            estimated_contribution=share,
        )

    return (
        timed("inertia of the liquid in the tube", start, "start-up time 2 L/((k + 1) u)"),
        timed("gas filling of the chamber", filling, "filling time at sonic conductance"),
        timed("valve lag", lag, "lag of the valve"),
        Term(
            term="liquid held in the tube",
            model=_judged(scene, held),
            why=f"S L over the liquid of a chamber at equal fills; {_against(scene, held)}",
            estimated_contribution=held,
        ),
    )
