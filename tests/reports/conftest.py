"""A small evidence document of the documented shape: for testing the page, not the physics."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import numpy as np
import pytest
from golden_pages import page_text
from matplotlib.figure import Figure

from ringbalance.reports.page import page_content, render, render_pages
from ringbalance.reports.sections import sections_of

R1, R2, B, THETA, T = 0.0205, 0.0445, 0.062, math.pi / 2, 2.777e-3
RHO, OMEGA, NU = 998.2, 10000 * math.pi / 30, 1.0e-6
BORE, LENGTH = 1.5e-3, 0.12


def _floats(values: Any) -> list[float]:
    return [float(value) for value in np.asarray(values).ravel()]


def _area(a: Any) -> Any:
    return THETA / 2 * (R2**2 - a**2) - 2 * T * (R2 - a)


def _volume() -> float:
    return float(_area(R1) * B)


def _radius(fill: Any) -> Any:
    grid = np.linspace(R1, R2, 2000)
    return np.interp(-np.asarray(fill) * _volume(), -_area(grid) * B, grid)


def _chamber() -> dict[str, Any]:
    fill = np.linspace(0, 0.5, 11)
    a = _radius(fill)
    wall = RHO * OMEGA**2 * (R2**2 - a**2) / 2
    paper = RHO * OMEGA**2 * fill * _volume() / (B * THETA)
    moment = 2 / 3 * RHO * B * (R2**3 - a**3) * math.sin(THETA / 2)
    plates = math.sqrt(2) / 2 * RHO * B * 2 * T * (R2**2 - a**2) / 2
    slope = 0.0718 + 0.0011 * np.cos(4 * math.pi * (fill - 0.25))
    return {
        "volume_m3": _volume(),
        "max_liquid_volume_m3": 0.5 * _volume(),
        "fill_ratio": _floats(fill),
        "free_surface_radius_m": _floats(a),
        "wall_pressure_Pa": _floats(wall),
        "wall_pressure_uncertainty": _floats(wall * 2e-7),
        "wall_pressure_input_uncertainty": _floats(wall * 0),
        "wall_pressure_paper_Pa": _floats(paper),
        "moment_kg_m": _floats(moment - plates),
        "moment_uncertainty": _floats(moment * 3e-7),
        "moment_paper_kg_m": _floats(moment),
        "lambda_per_transferred_mass_m": _floats(slope),
    }


def _tube() -> dict[str, Any]:
    u = np.geomspace(0.1, 20, 41)
    re = u * BORE / NU
    friction = np.where(re < 2300, 64 / re, 0.3164 * re**-0.25) * LENGTH / BORE
    rotation = 0.08 * friction
    ends, bends = np.full_like(u, 0.5), np.full_like(u, 0.7)
    k = friction + rotation + ends + bends
    state = np.where(re < 2000, "laminar", np.where(re < 4000, "transitional", "turbulent"))
    return {
        "velocity_m_s": _floats(u),
        "reynolds": _floats(re),
        "k": _floats(k),
        "k_uncertainty": _floats(0.12 * k),
        "flow_state": [str(name) for name in state],
        "in_range": [bool(value > 200) for value in re],
        "terms": {
            "friction": _floats(friction),
            "rotation": _floats(rotation),
            "entrance": _floats(ends),
            "bends": _floats(bends),
        },
    }


def _law() -> dict[str, Any]:
    fill = np.linspace(0, 0.5, 11)
    pressures = [0.7e6, 1.5e6]
    head = RHO * OMEGA**2 * _volume() * (2 * fill - 0.5) / (B * THETA)
    velocity, paper, regime = [], [], []
    for pressure in pressures:
        printed = np.sqrt(np.maximum(2 * (pressure + head) / RHO / 51, 0))
        separated = np.sqrt(np.maximum(2 * (pressure - 0.53e6 + head * 0.3) / RHO / 6, 0))
        found = np.minimum(printed * 1.9, separated)
        paper.append(_floats(printed))
        velocity.append(_floats(found))
        cavitated = separated < 1.9 * printed
        regime.append(
            [
                "blocked" if v == 0 else "separated" if t else "siphon"
                for v, t in zip(found, cavitated, strict=True)
            ]
        )
    return {
        "gas_pressure_Pa": pressures,
        "fill_ratio": _floats(fill),
        "velocity_m_s": velocity,
        "velocity_uncertainty": [[0.06 * v for v in row] for row in velocity],
        "regime": regime,
        "velocity_paper_m_s": paper,
    }


def _calibration() -> dict[str, Any]:
    return {
        "scene": "sample.toml",
        "chamber": _chamber(),
        "lambda": {
            "per_transferred_mass_m": 0.07204,
            "per_mass_difference_m": 0.03602,
            "uncertainty_m": 2.4e-5,
            "input_uncertainty_m": 0.0,
            "variation_over_range": 0.0151,
        },
        "tube": _tube(),
        "models_used": [
            {
                "term": "plates",
                "model": "exact geometry",
                "why": "the plates take 9 % of the chamber",
                "estimated_contribution": 0.09,
            },
            {
                "term": "gravity",
                "model": "left out",
                "why": "below a tenth of the tolerance at this speed",
                "estimated_contribution": 2.1e-4,
            },
            {
                "term": "rotation friction",
                "model": "correlation (Ito & Nanbu 1971, unverified)",
                "why": "adds more than the tolerance to k",
                "estimated_contribution": 0.08,
            },
        ],
        "residual_liquid": {
            "pair_moment_kg_m": 1238e-6,
            "usable_pair_moment_kg_m": 922e-6,
            "usable_pair_moment_uncertainty": 100e-6,
            "reach_kg_m": 922e-6,
            "reach_uncertainty": 100e-6,
        },
        "budgets": {
            "lambda": budget(0.07204, "m", numerical=2e-8, input=1.1e-4, model=2e-6),
            "drag_coefficient": budget(3.6, "1", numerical=1e-6, input=0.3, model=0.4),
            "velocity": budget(5.4, "m/s", numerical=1e-6, input=0.5, model=0.2),
            "wall_pressure": budget(4.184e5, "Pa", numerical=0.02, input=1700.0, model=280.0),
        },
        "status": {"code": "ok", "text": "solved"},
        "statistics": {"unknowns": 784.0},
    }


def _run(settling: float, steps: int, law: str) -> dict[str, Any]:
    time = np.linspace(0, settling + 1.5, 60)
    injections = [
        {
            "time_s": float(i * settling / steps),
            "chamber": "AB"[i % 2],
            "duration_s": 0.8 / (i + 1),
            "regime": "siphon" if law == "paper" else "separated",
            "regime_end": "siphon",
            "event": "none",
            "fill_before": 0.25 - 0.01 * i,
            "fill_after": 0.24 - 0.01 * i,
        }
        for i in range(steps)
    ]
    return {
        "balancer": "liquid_ring",
        "law": law,
        "settled": True,
        "settling_time_s": settling,
        "verdict": "settled",
        "loop_factor": 0.8 if law == "calibrated" else 0.575,
        "loop_factor_limit": 2.0,
        "stationary_deviation_m": 9e-9,
        "status": "settled below the limit",
        "time_s": _floats(time),
        "amplitude_m": _floats(1e-5 * np.exp(-time / settling * 5.3) + 4e-8),
        "samples": {"time_s": _floats(time[::6])},
        "injections": injections,
        "fill_ratio": {letter: _floats(0.25 + 0.01 * time) for letter in "ABCD"},
        "overshoots": 0,
        "misadjustments": 0,
    }


def _quantity(
    name: str, unit: str, value: float, reference: float, uncertainty: float, verdict: str
) -> dict[str, Any]:
    return {
        "name": name,
        "unit": unit,
        "value": value,
        "reference": reference,
        "error": value - reference,
        "uncertainty": uncertainty,
        "limit": uncertainty,
        "verdict": verdict,
    }


def _convergence(order: float, geometry: str) -> dict[str, Any]:
    sizes = [1.0, 0.5, 0.25, 0.125]
    return {
        "quantity": "pressure",
        "unit": "1",
        "formal_order": 3.0,
        "geometry": geometry,
        "h": sizes,
        "unknowns": [45, 153, 561, 2145],
        "error": [2e-3 * h**order for h in sizes],
        "observed_order": [order] * 3,
        "note": "L2 norm",
    }


def _claim(index: int, title: str, verdict: str, quantity: dict[str, Any] | None) -> dict[str, Any]:
    return {
        "id": f"claim_{index:02d}",
        "kind": "claim",
        "number": index,
        "title": title,
        "verdict": verdict,
        "claim": f"The paper says so in Eq. {index}.",
        "consequence": "Use the calibrated number instead.",
        "doubts": ["The plate thickness is inferred, not given."],
        "equations": [r"p = \rho\omega^2 r"],
        "quantities": [quantity] if quantity else [],
        "convergence": [],
        "headline": index in {6, 9, 10, 11},
    }


def verification() -> list[dict[str, Any]]:
    """Cases of every kind and verdict."""
    return [
        _claim(
            1, "Chamber volume", "confirmed", _quantity("volume", "m^3", 67.71e-6, 67.7e-6, 5e-8, "confirmed")
        ),
        _claim(
            6,
            "Wall pressure of Eq. 12",
            "refuted",
            _quantity("wall pressure", "Pa", 2.06e5, 1.9e5, 30.0, "refuted"),
        ),
        _claim(9, "k is about 50, and one number", "refuted", _quantity("k", "1", 3.4, 50.0, 0.4, "refuted")),
        _claim(
            10,
            "Works from 0.54 to 1.77 MPa",
            "confirmed with correction",
            _quantity("lowest pressure", "Pa", 5.39e5, 5.4e5, 4e3, "confirmed with correction"),
        ),
        _claim(
            11,
            "lambda is 72 mm within 0.7 %",
            "inconclusive",
            _quantity("lambda", "m", 0.07204, 0.072, 5e-4, "inconclusive"),
        ),
        _claim(14, "Trial algorithm in 40 s", "not run", None),
        {
            "id": "manufactured_pressure",
            "kind": "code_verification",
            "about": ["ring"],
            "verdict": "passed",
            "title": "Manufactured pressure field",
            "claim": "The solver converges at third order.",
            "quantities": [_quantity("finest error", "1", 4e-6, 0.0, 1e-5, "passed")],
            "convergence": [_convergence(3.0, "quadratic"), _convergence(2.0, "straight")],
            "doubts": [],
        },
        {
            "id": "coverage",
            "kind": "solution_verification",
            "verdict": "not run",
            "title": "Coverage of the bars",
            "about": ["uncertainty"],
            "claim": "The bars hold 95 %.",
            "cost": "heavy",
            "quantities": [],
            "convergence": [],
            "doubts": [],
        },
        {
            "id": "measured_tubes",
            "kind": "validation",
            "about": ["friction"],
            "verdict": "confirmed",
            "title": "Friction in tubes against measurements",
            "claim": "Friction is as measured.",
            "cost": "light",
            "quantities": [_quantity("share", "1", 0.96, 0.95, 0.02, "confirmed")],
            "numbers": {"points": 1536.0, "share_within": 0.968, "bias": -0.0162, "standard_deviation": 0.05},
            "convergence": [],
            "doubts": [],
        },
    ]


def _profile() -> dict[str, Any]:
    fill = 0.25
    a = float(_radius(fill))
    r = np.linspace(a, R2, 17)
    implied = math.sqrt(R2**2 - 2 * fill * _volume() / (B * THETA))
    return {
        "fill_ratio": fill,
        "radius_m": _floats(r),
        "pressure_Pa": _floats(RHO * OMEGA**2 * (r**2 - a**2) / 2),
        "paper_radius_m": _floats(np.linspace(implied, R2, 17)),
        "paper_pressure_Pa": _floats(RHO * OMEGA**2 * (np.linspace(implied, R2, 17) ** 2 - implied**2) / 2),
    }


@pytest.fixture
def unwritten(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are painted but not written out, which takes most of a page: for tests that read its text."""

    def savefig(_: object, buffer: IO[str], **__: object) -> None:
        buffer.write('<svg ><path d="M 0 0" /></svg>')

    monkeypatch.setattr(Figure, "savefig", savefig)


@pytest.fixture
def said(request: pytest.FixtureRequest) -> Callable[[dict[str, Any], str], str]:
    """The text of one section's page, without the other sections."""
    request.getfixturevalue("unwritten")

    def text(evidence: dict[str, Any], name: str) -> str:
        views = {s.name: s.view(evidence) if s.name == name else None for s in sections_of(evidence)}
        content = page_content(evidence, sections_by=lambda _: views)
        file = f"{content.context['sections'][0]['place']}.html"
        return page_text(render_pages(content, documents=(file,))[file])

    return text


@pytest.fixture
def evidence() -> dict[str, Any]:
    """A whole evidence document, fresh for each test."""
    return document()


@pytest.fixture(scope="session")
def whole() -> dict[str, Any]:
    """The same document, shared: not to be changed."""
    return document()


@pytest.fixture(scope="session")
def pages() -> dict[str, str]:
    """Report and annex of that document, without 3-D pictures."""
    return render(document())


@pytest.fixture(scope="session")
def page(pages: dict[str, str]) -> str:
    """The report of that document."""
    return pages["report.html"]


@pytest.fixture(scope="session")
def annex(pages: dict[str, str]) -> str:
    """The annex of that document."""
    return pages["annex.html"]


def budget(value: float, unit: str, **parts: float) -> dict[str, Any]:
    """The budget of a quantity; parts in its unit."""
    inputs = {"tube.bore": parts["input"], "rotor.speed": 0.0}
    total = math.hypot(*parts.values())
    return {"value": value, "unit": unit, **parts, "total": total, "inputs": inputs}


def document() -> dict[str, Any]:
    """A whole evidence document: what is calculated here, and the rest of `sample.json`."""
    rest: dict[str, Any] = json.loads(Path(__file__).with_name("sample.json").read_text(encoding="utf-8"))
    rest["pressure"]["profile"] = _profile()
    return {
        **rest,
        "flow_law": _law(),
        "calibration": _calibration(),
        "closed_loop": {"calibrated": _run(3.4, 6, "calibrated"), "paper": _run(4.6, 7, "paper")},
        "verification": verification(),
    }
