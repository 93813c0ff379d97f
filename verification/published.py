"""Tabulated references of the cases: CSV files whose first lines, marked #, give source and uncertainty."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from ringbalance.physics.tube.friction import friction_factor, friction_uncertainty
from ringbalance.scene.arrays import BoolArray, FloatArray


def read_rows(case_id: str, name: str) -> tuple[Mapping[str, str], ...]:
    """Rows of a file in the case's data folder, column name to text."""
    path = files("ringbalance.verification.cases") / case_id / "data" / name
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return tuple(csv.DictReader(lines))


@dataclass(frozen=True, kw_only=True)
class FrictionPoints:
    """Darcy friction factors of straight tubes."""

    reynolds: FloatArray
    roughness: FloatArray
    """ks/d."""
    friction: FloatArray

    def where(self, chosen: slice | BoolArray) -> FrictionPoints:
        """Some of the points."""
        return FrictionPoints(
            reynolds=self.reynolds[chosen], roughness=self.roughness[chosen], friction=self.friction[chosen]
        )

    def uncertainty(self) -> FloatArray:
        """Expanded uncertainty (95 %) of the formula at the points."""
        return np.array(
            [
                float(friction_uncertainty(reynolds=re, relative_roughness=float(wall)))
                for re, wall in zip(self.reynolds, self.roughness, strict=True)
            ]
        )


def friction_formula(reynolds: FloatArray, roughness: FloatArray) -> FloatArray:
    """The program's friction factor at several points."""
    pairs = zip(reynolds, roughness, strict=True)
    return np.array([float(friction_factor(reynolds=re, relative_roughness=float(e))) for re, e in pairs])


def smooth_tube() -> FrictionPoints:
    """McKeon et al. (2004), Oregon facility, in ascending order."""
    rows = read_rows("friction_blend", "mckeon2004_oregon_smooth.csv")
    reynolds, friction = (np.array([float(row[key]) for row in rows]) for key in ("Re", "f_darcy"))
    return FrictionPoints(reynolds=reynolds, roughness=np.zeros_like(reynolds), friction=friction)


def sand_rough_tubes() -> FrictionPoints:
    """Nikuradse (1933)."""
    rows = read_rows("friction_blend", "nikuradse1933_rough.csv")
    reynolds, ratio, friction = (
        np.array([float(row[key]) for row in rows]) for key in ("Re", "R_over_ks", "f_darcy")
    )
    return FrictionPoints(reynolds=reynolds, roughness=0.5 / ratio, friction=friction)
