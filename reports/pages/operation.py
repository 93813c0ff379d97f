"""Where the disc works: the operating map and the dimensioned section."""

from __future__ import annotations

from typing import Final

import numpy as np

from ringbalance.mesh.outline import outlines
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import Regime
from ringbalance.reports.figures.operation import operating_map
from ringbalance.reports.figures.section import disc_section
from ringbalance.reports.section import Record, Section, Work
from ringbalance.scene.arrays import IntArray
from ringbalance.scene.chamber_file.record import ChamberGeometry

_FILLS: Final = 101
_PRESSURES: Final = 121
_HIGHEST: Final = 1.5
"""Top of the map over the scene's gas pressure, or over the priming pressure where that is higher."""
_PLACES: Final = 7
"""Of an outline, m."""
_SPILLING: Final = "spilling"
_NAMES: Final = (*(regime.label for regime in Regime), _SPILLING)


def _regimes(law: CalibratedLaw, fill: np.typing.ArrayLike, pressure: np.typing.ArrayLike) -> IntArray:
    """Numbers of `_NAMES` for an unprimed tube.

    Spilling: a separated column that has not carried the gas off the crest and so does not prime the tube.
    """
    flow = law.evaluate(fill_ratio=fill, gas_pressure=pressure)
    ends = law.ends(fill_ratio=fill, gas_pressure=pressure)
    covered = ends.downstream_hydrostatic >= ends.port_pressure
    spills = (flow.regime == Regime.SEPARATED) & ~flow.primed & covered
    return np.asarray(np.where(spills, _NAMES.index(_SPILLING), flow.regime), dtype=np.int64)


def _collect(work: Work) -> Record:
    scene, calibration = work.scene, work.calibration
    law, point, rest = calibration.flow_law, calibration.operating_point, calibration.residual
    top = _HIGHEST * max(scene.gas.pressure, point.priming_vented or 0.0)
    fill, pressure = np.linspace(0, law.max_fill_ratio, _FILLS), np.linspace(0, top, _PRESSURES)
    at = int(_regimes(law, point.fill_ratio, scene.gas.pressure))
    return {
        "fill_ratio": fill.tolist(),
        "gas_pressure_Pa": pressure.tolist(),
        "regimes": list(_NAMES),
        "regime": ["".join(map(str, row)) for row in _regimes(law, fill[None, :], pressure[:, None])],
        "point": {
            "fill_ratio": point.fill_ratio,
            "gas_pressure_Pa": scene.gas.pressure,
            "regime": _NAMES[at],
        },
        "working_fill_ratio": [rest.fill_ratio, rest.largest_fill_ratio],
        "disc": _disc(work),
    }


def _disc(work: Work) -> Record:
    """The disc's dimensions and first fill; of an imported chamber its sections too."""
    disc, tube = work.scene.disc, work.scene.tube
    imported = {} if disc.geometry is None else {"outlines": _outlines(disc.geometry)}
    return imported | {
        "chambers": disc.chambers,
        "central_angle_rad": disc.central_angle,
        "outer_radius_m": disc.outer_radius,
        "inner_radius_m": disc.inner_radius,
        "axial_width_m": disc.axial_width,
        "plate_thickness_m": disc.plate_thickness,
        "fill_ratio": disc.initial_fill,
        "port_radius_m": tube.port_radius,
        "crest_radius_m": tube.hump_radius,
        "bore_m": tube.bore,
        "length_m": tube.length,
        "origins": {key: work.scene.origin_of(f"tube.{key}") for key in ("bore", "length", "hump_radius")},
    }


def _outlines(geometry: ChamberGeometry) -> Record:
    """Sections through the middle of a chamber, across the shaft, (x, y), and along it, (x, z), m."""
    return {
        name: [np.round(loop, _PLACES).tolist() for loop in outlines(geometry, axis=axis)]
        for name, axis in (("across_m", 2), ("along_m", 1))
    }


def _view(found: Record, evidence: Record) -> Record:
    chamber, disc = evidence["calibration"]["chamber"], found["disc"]
    surface = np.interp(disc["fill_ratio"], chamber["fill_ratio"], chamber["free_surface_radius_m"])
    disc = {**disc, "free_surface_radius_m": float(surface)}
    return {"map": operating_map(found), "disc": disc_section(disc)}


SECTION: Final = Section(
    name="operation", title="Where it works", place="report", collect=_collect, show=_view
)
