"""Measurements and their predictions by cases: friction in tubes and ducts, pressure, a rotor."""

from __future__ import annotations

import dataclasses
import math
from typing import Final

import numpy as np

from ringbalance.identification.kinds.bench import tube_numbers
from ringbalance.identification.kinds.kind import Observations
from ringbalance.physics.tube.rotation_table import laminar_ratio
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, FigureCurve, Found, Level, Reference, as_found, figure
from ringbalance.verification.navier_stokes.flow import FlowSystem
from ringbalance.verification.navier_stokes.tube import (
    POISEUILLE_GRADIENT,
    DuctMesh,
    SectionMesh,
    march_section,
)
from ringbalance.verification.validation.comparison import (
    MUTATIONS,
    compare,
    data_evidence,
    friction,
    measurements,
    with_left_out,
)

_LAMINAR_TO_RE: Final = 1800.0
_TURBULENT_FROM_RE: Final = 4000.0
_CRITICAL_RE: Final = 2300.0
"""Reynolds number up to which McKeon's readings follow laminar flow."""
_SMOOTH: Final = ("stanton_pannell_1914", "stanton_pannell_1914_oil", "huebscher_1947_round", "senecal_1951")
_FULLY_ROUGH: Final = 70.0
"""ks+ above which the wall is fully rough."""
CALIBRATING: Final = (*(f"tube {number} (bore)" for number in range(1, 6)), "cut (bore)")
"""Points of Eisenklam to which the bore of their tube was fitted, not judged."""
_DEVELOPED: Final = 0.0125
"""L/(d Re) from which the expected effect of the undeveloped profile is within the outlet's interval."""
_CONTRADICTED_PA: Final = 1.5e5
"""Pressure below which the cut tube contradicts the others."""
_SQUARE: Final = ((0.5, 2000.0, 8e-6, 0.06), (1.0, 1000.0, 1e-5, 0.06), (1.0, 2000.0, 4e-6, 0.04))
_FAST: Final = (3.3, 1810.0, 4e-6, 0.03)
"""S = omega d/U, Re, step and time over d^2/nu; the last is the end of the correlated simulations."""
_TUBE: Final = (0.5, 2000.0, 5e-6, 0.05)
_CELLS: Final = {
    "light": DuctMesh(across_axis=16, along_axis=10),
    "heavy": DuctMesh(across_axis=24, along_axis=16),
}
_WASHER_KG_M: Final = 12.4e-6
"""Unbalance of a washer, kg m."""
_WASHER_UNCERTAINTY_KG_M: Final = 0.5e-6
"""Expanded uncertainty (95 %) of a washer's unbalance, kg m."""
_TAUGHT_COUNTS: Final = (0, 1, 2)
"""Numbers of washers in the runs to which the coefficient was fitted."""
_PREDICTED_COUNTS: Final = (3, 4)


def smooth_tubes(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Friction in smooth tubes, laminar to turbulent.

    McKeon's readings below Re 4000 are not judged: their authors report laminar ones up to 14 % high.
    """
    points = friction(*map(measurements, _SMOOTH), _mckeon(_TURBULENT_FROM_RE, np.inf), mutation=defect)
    left_out = {
        "mckeon_laminar": friction(_mckeon(0.0, _CRITICAL_RE)),
        "mckeon_transition": friction(_mckeon(_CRITICAL_RE, _TURBULENT_FROM_RE)),
    }
    reynolds, statistics = points.columns["reynolds"], points.statistics
    parts = {
        "laminar": points.where(reynolds < _LAMINAR_TO_RE),
        "transitional": points.where((reynolds >= _LAMINAR_TO_RE) & (reynolds < _TURBULENT_FROM_RE)),
        "turbulent": points.where(reynolds >= _TURBULENT_FROM_RE),
    }
    numbers = statistics | with_left_out(points, left_out)
    for name, part in parts.items():
        numbers |= {f"{name}_{key}": value for key, value in part.statistics.items()}
    return Evidence(
        quantities=as_found(share_within=statistics["share_within"], bias=abs(numbers["turbulent_bias"])),
        numbers=numbers,
        series=(parts["turbulent"].over_reynolds("smooth tubes"),),
    )


def _mckeon(low: float, high: float) -> Observations:
    data = measurements("mckeon_2004")
    reynolds = data.columns["reynolds"]
    return data.where((reynolds >= low) & (reynolds < high))


def rough_tubes(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Friction in tubes roughened with sand."""
    data = measurements("nikuradse_1933")
    points = friction(data, mutation=defect if defect in MUTATIONS else None)
    if defect == "roughness_ignored":
        smooth = data.with_columns(relative_roughness=np.zeros(len(data)))
        points = dataclasses.replace(points, predicted=friction(smooth).predicted)
    wall, statistics = points.columns["relative_roughness"], points.statistics
    grain = points.columns["reynolds"] * np.sqrt(points.measured / 8) * wall
    rough = points.where(grain > _FULLY_ROUGH).statistics
    return Evidence(
        quantities=as_found(share_within=statistics["share_within"], fully_rough=abs(rough["bias"])),
        numbers={
            **statistics,
            **with_left_out(points),
            "worst": np.max(points.predicted / points.measured - 1),
            "rough_points": rough["points"],
            "rough_bias": rough["bias"],
            "rough_standard_deviation": rough["standard_deviation"],
        },
        series=tuple(
            points.where(wall == roughness).over_reynolds(f"a tube with ks/d = {roughness:.2g}")
            for roughness in np.unique(wall)[[0, -1]]
        ),
    )


def ducts(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Friction in rectangular ducts, laminar to turbulent."""
    sets = [measurements(name) for name in ("cornish_1928", "huebscher_1947_ducts")]
    if defect == "circular_section":
        # An aspect ratio of zero stands for a tube.
        sets = [each.with_columns(aspect_ratio=np.zeros(len(each))) for each in sets]
    mutation = defect if defect in MUTATIONS else None
    points = friction(*sets, mutation=mutation)
    wide = np.char.find(points.series, "8:1") >= 0
    narrow, reynolds = points.where(~wide), points.columns["reynolds"][~wide]
    every, laminar, turbulent = (
        part.statistics
        for part in (
            narrow,
            narrow.where(reynolds < _LAMINAR_TO_RE),
            narrow.where(reynolds >= _TURBULENT_FROM_RE),
        )
    )
    return Evidence(
        quantities=as_found(share_within=every["share_within"], laminar=abs(laminar["bias"])),
        numbers={
            **every,
            "laminar_points": laminar["points"],
            "laminar_bias": laminar["bias"],
            "turbulent_points": turbulent["points"],
            "turbulent_bias": turbulent["bias"],
            "turbulent_standard_deviation": turbulent["standard_deviation"],
            **with_left_out(narrow, {"wide": points.where(wide)}),
        },
        series=(friction(sets[0], mutation=mutation).over_reynolds("a rectangular duct (2.9 to 1)"),),
    )


def laminar_tubes(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Pressure over whole tubes in laminar flow.

    Points to which a bore was fitted, that contradict others, or with undeveloped flow are not judged.
    """
    data = measurements("eisenklam_1958")
    reynolds, slenderness = tube_numbers(data)
    taught, cut = np.isin(data.series, CALIBRATING), np.char.startswith(data.series, "cut")
    contradicted = cut & (data.columns["pressure"] < _CONTRADICTED_PA) & ~taught
    usable, developed = ~taught & ~contradicted, slenderness >= _DEVELOPED * reynolds
    judged = data.where(usable & developed)
    evidence = data_evidence(judged, unit="Pa", mutation=defect)
    left_out = {
        "contradicted": compare(data.where(contradicted)),
        "short": compare(data.where(usable & ~developed)),
    }
    uncut = compare(data.where(usable & np.char.startswith(data.series, "tube")))
    more = {
        **with_left_out(compare(judged, mutation=defect), left_out, taught=int(taught.sum())),
        "laminar_points": evidence.numbers["points"],
        "long_worst": np.max(np.abs(uncut.predicted / uncut.measured - 1)),
    }
    return dataclasses.replace(evidence, numbers={**evidence.numbers, **more})


def rotating_duct(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Friction in a rotating square duct, with laminar flow that may fluctuate."""
    square, points = _CELLS[level].system(), (*_SQUARE, _FAST)
    s, re = (np.array([point[i] for point in points]) for i in (0, 1))
    slower = 1.0 if defect is None else 0.9
    gradients = [_mean_gradient(square, point, slower) for point in points]
    # 1.09 (C_f/Ek^(1/2))^1.25 = Ro with Ro = 2 S and Ek = 1/(S Re).
    fanning, measured = np.array(gradients) / (2 * re), (2 * s / 1.09) ** 0.8 / np.sqrt(s * re)
    deviation = fanning / measured - 1
    shown = figure(
        "Fanning friction factor of a rotating square duct, computed and measured",
        ("rotation number 2 omega d/U", "1", 2 * s),
        FigureCurve("computed", "1", fanning, style="points"),
        FigureCurve("correlation of measurements", "1", measured, style="reference"),
        log=True,
    )
    numbers = {"signed_bias": float(np.mean(deviation))}
    if defect is None:
        # Friction of the circular tube, solved in time as well, over the table's steady one, less one.
        tube = SectionMesh(around=7, across=11, wall_ratio=15.0).system()
        tube_s, tube_re, _, _ = _TUBE
        steady = float(laminar_ratio(reynolds=tube_re, rotation_reynolds=tube_s * tube_re))
        numbers["tube"] = _mean_gradient(tube, _TUBE) / POISEUILLE_GRADIENT / steady - 1
    return Evidence(
        quantities=as_found(bias=abs(np.mean(deviation)), worst=np.max(np.abs(deviation))),
        numbers=numbers,
        series=(shown,),
    )


def _mean_gradient(system: FlowSystem, point: tuple[float, ...], rotation: float = 1.0) -> float:
    """Mean driving gradient over the second half of the time."""
    s, re, step, time = point
    gradients = march_section(
        system=system, kl=rotation * s * re**2, s=rotation * s, step=step, steps=round(time / step)
    )
    return float(np.mean(gradients[-round(gradients.size / 2) :]))


def rotor(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    """Vibration of a rotor with known unbalances: larger ones predicted from a fit to small ones."""
    run = measurements("rodrigues_2011")
    readings = {count: _readings(run, "plain", count) for count in range(5)}
    amplitudes = [float(np.mean(reading)) for reading in readings.values()]
    # The amplitudes with none, one and two washers give the rotor: |V0 + n K u|^2 = |V0|^2 + 2 n Re(V0* K u)
    # + n^2 |K u|^2 for n = 0, 1, 2 is solved for |V0|, |K u| and the angle between them.
    none, first, second = (a**2 for a in amplitudes[:3])
    square = (second - 2 * first + none) / 2
    cosine = (first - none - square) / (2 * math.sqrt(square * none))
    kappa = MUTATIONS[defect] * (math.sqrt(square) / _WASHER_KG_M)
    calibrated = dataclasses.replace(
        scene.rotor,
        influence_coefficient=kappa,
        lag_angle=0.0,
        initial_amplitude=amplitudes[0],
        initial_phase=math.acos(cosine),
    )
    unbalance = _WASHER_KG_M * np.arange(5)
    predicted = np.abs(calibrated.vibration(unbalance))
    standard_uncertainty = kappa * _WASHER_UNCERTAINTY_KG_M / 2
    quantities = {}
    for count in _PREDICTED_COUNTS:
        # Mean over all speeds; u_D from the scatter over the speeds and from the washers on the disc.
        mean, scatter = amplitudes[count], float(np.std(readings[count], ddof=1))
        washers = mean * _WASHER_UNCERTAINTY_KG_M / (2 * _WASHER_KG_M * math.sqrt(count))
        quantities[f"washers_{count}"] = Found(
            value=float(predicted[count]),
            # The coefficient was fitted to two washers: their error, sqrt(2) of one's, counts n/2 times.
            input=standard_uncertainty * count / math.sqrt(2),
            reference=Reference(value=mean, uncertainty=math.hypot(washers, scatter)),
        )
    shown = figure(
        "vibration of a rotor, measured and predicted",
        ("unbalance", "kg*m", unbalance),
        FigureCurve("predicted", "m", predicted),
        FigureCurve("measured", "m", np.array(amplitudes), style="points"),
    )
    return Evidence(
        quantities=quantities,
        numbers={
            "points": sum(readings[count].size for count in _PREDICTED_COUNTS),
            "taught_points": sum(readings[count].size for count in _TAUGHT_COUNTS),
            "worst_mean": max((predicted[n] / amplitudes[n] - 1 for n in _PREDICTED_COUNTS), key=abs),
            "influence_coefficient": kappa,
            "balls_up": np.mean(_readings(run, "abb_runup", 4)),
            "balls_down": np.mean(_readings(run, "abb_rundown", 4)),
        },
        series=(shown,),
    )


def _readings(run: Observations, series: str, washers: int) -> FloatArray:
    chosen = (run.series == series) & (run.columns["washers"] == washers)
    return np.asarray(run.columns["amplitude"][chosen], dtype=np.float64)
