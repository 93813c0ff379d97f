"""Document data: what the report was made of, who signs it, symbols and sources."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from types import MappingProxyType
from typing import Final

from ringbalance.reports.section import Record, Section, Table

_KEPT: Final = 12
"""Digits of a hash that are printed in a list."""
_LIQUID_RING: Final = (
    ("B", "m", "axial width"),
    ("d", "m", "bore"),
    ("h", "1", "loop factor"),
    ("k", "1", "loss coefficient"),
    ("P", "Pa", "wall pressure"),
    ("p_c", "Pa", "cavity pressure"),
    ("R₁", "m", "inner radius"),
    ("R₁′", "m", "level"),
    ("R₂", "m", "outer radius"),
    ("r_m", "m", "siphon crest"),
    ("T", "s", "valve-open time"),
    ("U", "kg m", "balancing moment"),
    ("u", "m/s", "flow velocity"),
    ("x", "1", "fill ratio"),
    ("α", "m/(kg m)", "influence coefficient"),
    ("θ", "rad", "central angle"),
    ("λ", "m", "lever arm"),
)
_ECCENTRIC_MASS: Final = (
    ("b", "kg m", "moment of a mass"),
    ("m_b", "kg", "eccentric masses"),
    ("μ_f", "m", "friction arm"),
    ("r_b", "m", "track radius"),
    ("θ", "kg m", "imbalance"),
    ("φ", "rad", "angle of a mass"),
    ("ω", "rad/s", "speed"),
)
NOMENCLATURE: Final = MappingProxyType({"liquid_ring": _LIQUID_RING, "eccentric_mass": _ECCENTRIC_MASS})
"""Symbol, unit and term of the glossary, by kind of balancer."""
_DEFINITIONS: Final = MappingProxyType(
    {
        "liquid_ring": "Overshoot: a correction that takes the vibration past zero. Misadjustment: an "
        "injection after which the amplitude is higher by more than the noise. Settled: within the limit for "
        "the hold time, and expected to stay. Hovering: near the limit without a reason to stay there. "
        "Separated: the column parts over the siphon crest, and only the driven chamber sets the flow.",
        "eccentric_mass": "Settled: the amplitude is within the limit and stays there to the end of the run. "
        "Settling time: from the start of the run until then. Locked: the masses clamped where they start. "
        "Friction arm: friction torque over the centrifugal force of a mass. Gain margin: factor by which a "
        "loop’s gain could grow before the loop is unstable.",
    }
)
_RING_SOURCES: Final = (
    "Pan X., Wu H.-Q., Gao J.-J., Mu Y.-Z.: Performance Analysis and Control Simulation of Pneumatic "
    "Liquid Online Automatic Balancing System for Rotating Machinery. The liquid-ring paper; its text "
    "names no DOI.",
    "Pan X., Wu H.-Q., Gao J.-J. et al.: New liquid transfer active balancing system using compressed air "
    "for grinding machine. J. Vib. Acoust. (2014), doi:10.1115/1.4028507. Reference [30] of the liquid-ring "
    "paper; not seen.",
    "McKeon B. J. et al.: Friction factors for smooth pipe flow. J. Fluid Mech. 511 (2004) 41, "
    "doi:10.1017/S0022112004009796.",
    "Nikuradse J.: Strömungsgesetze in rauhen Rohren. VDI Forschungsheft 361 (1933); no DOI.",
    "Celik I. B. et al.: Procedure for estimation and reporting of uncertainty due to discretization in CFD "
    "applications. J. Fluids Eng. 130 (2008) 078001, doi:10.1115/1.2960953.",
    "Roache P. J.: Code verification by the method of manufactured solutions. J. Fluids Eng. 124 (2002) 4, "
    "doi:10.1115/1.1436090.",
)
_SOURCES: Final = (
    "Jung D.: A Control Strategy of Actively Actuated Eccentric Mass System for Imbalance Rotor Vibration. "
    "Actuators 9 (2020) 69, doi:10.3390/act9030069.",
    "ASME V&V 20-2009, Standard for verification and validation in computational fluid dynamics and heat "
    "transfer.",
    "ISO 21940-11:2016, Mechanical vibration, rotor balancing, part 11: procedures and tolerances for rotors "
    "with rigid behaviour.",
    "NASA-STD-7009B, Standard for models and simulations.",
)
"""Those of every report."""


def _view(_own: Record, evidence: Record) -> Record:
    balancer = evidence.get("balancer", "liquid_ring")
    return {
        "facts": _facts(evidence),
        "signatures": Table(
            caption="Sign-off; empty until filled in by hand.",
            heads=("Role", "Name", "Date", "Signature"),
            rows=[(role, "", "", "") for role in ("Prepared", "Checked", "Approved")],
            style="whole",
        ),
        "nomenclature": NOMENCLATURE[balancer],
        "definitions": _DEFINITIONS[balancer],
        "bibliography": (*(_RING_SOURCES if balancer == "liquid_ring" else ()), *_SOURCES),
    }


def _facts(evidence: Record) -> tuple[tuple[str, str], ...]:
    made, scene = evidence.get("provenance") or {}, evidence["scene"]
    commit = made.get("commit") or "not made from a checkout"
    versions = evidence["versions"]
    fields = "" if evidence.get("balancer", "liquid_ring") != "liquid_ring" else ", fields/"
    return (
        ("Status and revision", f"draft; ringbalance {versions['ringbalance']}"),
        ("Commit", commit + (", with local changes" if made.get("dirty") else "")),
        ("Command", made.get("command") or "not recorded"),
        ("Date and machine", f"{evidence['times']['date']}; {made.get('machine') or 'not recorded'}"),
        ("Scene file", f"{scene['file']}, SHA-256 {scene['sha256']}"),
        ("Scene values", f"SHA-256 {scene['values_sha256']}; kept evidence names its scene by these"),
        ("Lock file", f"SHA-256 {made['lock_sha256']}" if made.get("lock_sha256") else "not there"),
        ("evidence.json", f"SHA-256 {hashlib.sha256(evidence_text(evidence).encode()).hexdigest()}"),
        ("Kept evidence", _kept(evidence)),
        ("Seeds", ", ".join(f"{name} {value}" for name, value in evidence["seeds"].items())),
        ("Beside this file", f"annex.html, evidence.json, figures/{fields} and tables/"),
    )


def evidence_text(evidence: Record) -> str:
    """The evidence as its file holds it."""
    return json.dumps(evidence, allow_nan=False, indent=1, ensure_ascii=False) + "\n"


def _kept(evidence: Record) -> str:
    """Cases that were not run for this report, with the date of the run shown and a heavy one's scene."""
    kept = [case for case in evidence["verification"] if case.get("date")]
    told = [f"{c['id']} of {c['date']}, values {str(c.get('scene_sha256', ''))[:_KEPT]}" for c in kept]
    dates = Counter(evidence["times"].get("kept_cases", {}).values())
    told += [f"{n} that look at no scene, run by the same program on {day}" for day, n in dates.items()]
    return "; ".join(told) or "none: every case shown was run for this report, or not at all"


SECTION: Final = Section(
    name="document", title="Document data, symbols and sources", place="report", show=_view
)
