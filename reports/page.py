"""What the page shows, from the evidence alone: texts, tables and figures, each made once."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from types import MappingProxyType
from typing import Final

from PIL import Image

from ringbalance.reduced_model.budget import UNSTATED
from ringbalance.reports import summary
from ringbalance.reports.equations import equation_svg, equations
from ringbalance.reports.figures.calibration import chamber_figures, tube_figures
from ringbalance.reports.figures.loop import loop_figures
from ringbalance.reports.figures.style import Drawing
from ringbalance.reports.pages.cases import case_view
from ringbalance.reports.pages.eccentric_scene import BALANCER
from ringbalance.reports.prose import named_with_origin, states_uncertainty, traced
from ringbalance.reports.section import Cells, Record, Table
from ringbalance.reports.sections import drawings_in, section_views, viewed
from ringbalance.reports.traced import known_width, placed
from ringbalance.results.numbers import (
    PLUS_MINUS,
    display_unit,
    fixed,
    measured,
    number,
    percent,
    short,
    shown,
)

Facts = tuple[tuple[str, str], ...]
"""Labels and texts."""

ANNEX: Final = "annex.html"
DOCUMENTS: Final[Mapping[str, Record]] = MappingProxyType(
    {
        ANNEX: {
            "place": "annex",
            "kind": "Verification annex",
            "other": {"file": "report.html", "title": "The report"},
        },
        "report.html": {
            "place": "report",
            "kind": "Verification report",
            "other": {"file": ANNEX, "title": "Annex: evidence and details"},
        },
    }
)
"""The documents by file name; the report last, for where it is, all else is."""
_LEADING: Final = re.compile(r"\d+(?:\.\d+)?")
_FIRST_INJECTIONS: Final = 12
"""Injections that are listed."""
_PICTURE_WIDTH: Final = 1000
_PICTURE_QUALITY: Final = 80
_PICTURE_EFFORT: Final = 2
"""Of 6; more saves a twentieth of the bytes in twice the time."""


def _column(values: list[float], unit: str, *, digits: int = 6) -> list[str]:
    """One column in one unit and to one decimal place, that of its largest value's last digit."""
    display = display_unit(unit, *values)
    largest = max(abs(value) for value in values) * display.factor
    decimals = max(digits - 1 - math.floor(math.log10(largest)), 0) if largest else 0
    return [fixed(value * display.factor, decimals) for value in values]


def _traced(texts: list[str], key: str) -> list[str]:
    return [traced(text, f"calibration.chamber.{key}.{place}") for place, text in enumerate(texts)]


def _relative(values: list[float], reference: list[float]) -> list[float | None]:
    return [value / base if base else None for value, base in zip(values, reference, strict=True)]


def _chamber_table(chamber: Record) -> Table:
    """The chamber over its fill: heads carry the units, so that the cells are bare numbers."""
    pressure, moment = chamber["wall_pressure_Pa"], chamber["moment_kg_m"]
    paper, paper_moment = chamber["wall_pressure_paper_Pa"], chamber["moment_paper_kg_m"]
    columns = [
        [short(fill) for fill in chamber["fill_ratio"]],
        _traced(_column(chamber["free_surface_radius_m"], "m", digits=5), "free_surface_radius_m"),
        _traced(_column(pressure, "Pa"), "wall_pressure_Pa"),
        [number(u, digits=1) for u in _relative(chamber["wall_pressure_uncertainty"], pressure)],
        _traced(_column(paper, "Pa", digits=4), "wall_pressure_paper_Pa"),
        _errors(paper, pressure),
        _traced(_column(moment, "kg m"), "moment_kg_m"),
        [number(u, digits=1) for u in _relative(chamber["moment_uncertainty"], moment)],
        _traced(_column(paper_moment, "kg m", digits=4), "moment_paper_kg_m"),
        _errors(paper_moment, moment),
    ]
    pa, kg_m = display_unit("Pa", *pressure).symbol, display_unit("kg m", *moment).symbol
    return Table(
        caption="One chamber over its fill: mean pressure of the liquid on the outer wall, and balancing "
        "moment. ± is the expanded uncertainty (95 %) relative to the value, from grid convergence.",
        heads=(
            *("Fill ratio", "Free surface\nmm"),
            *(f"Wall pressure\n{pa}", "±\nrelative", f"by Eq. 12\n{pa}", "error of\nEq. 12"),
            *(f"Moment\n{kg_m}", "±\nrelative", f"by Eq. 7\n{kg_m}", "error of\nEq. 7"),
        ),
        rows=list(zip(*columns, strict=True)),
        style="dense",
    )


def _errors(paper: list[float], found: list[float]) -> list[str]:
    ratios = _relative(paper, found)
    return [percent(None if ratio is None else ratio - 1, signed=True) for ratio in ratios]


def _drag_table(tube: Record, point: Record) -> Table:
    """The terms of k at the tabulated velocity nearest to the operating point."""
    velocity = point["k_at_velocity_m_s"] or tube["velocity_m_s"][-1]
    i = min(range(len(tube["k"])), key=lambda i: abs(math.log(tube["velocity_m_s"][i] / velocity)))
    speed, reynolds = shown(tube["velocity_m_s"][i], "m/s", digits=3), number(tube["reynolds"][i], digits=3)
    terms = [(name.replace("_", " "), number(v[i], digits=3)) for name, v in tube["terms"].items()]
    return Table(
        caption=f"Terms of k at {speed}, Re {reynolds}, {tube['flow_state'][i]}.",
        heads=("Term", "Contribution to k"),
        rows=[*terms, ("k", measured(tube["k"][i], tube["k_uncertainty"][i]))],
    )


def _injections(run: Record | None) -> Table:
    rows = [_injection(row) for row in (run or {"injections": []})["injections"]]
    rest = len(rows) - _FIRST_INJECTIONS
    return Table(
        caption="Injections under the calibrated law"
        + (f"; {rest} more in the evidence." if rest > 0 else "."),
        heads=("Time", "Chamber", "Gas on for", "Regime", "Fill before", "after"),
        rows=rows[:_FIRST_INJECTIONS],
    )


def _injection(row: Record) -> Cells:
    regimes = dict.fromkeys((row["regime"], row.get("regime_end") or row["regime"]))
    times = [shown(row[key], "s", digits=3) for key in ("time_s", "duration_s")]
    fills = [fixed(row[key], 4) for key in ("fill_before", "fill_after")]
    return times[0], row["chamber"], times[1], " to ".join(regimes), *fills


def _loop_notes(runs: Record) -> list[tuple[str, str]]:
    """How each run ended, in its own words."""
    names = {"calibrated": "Calibrated law", "paper": "The paper’s law"}
    return [(names[law], runs[law]["status"]) for law in names if law in runs]


def _models(rows: list[Record]) -> Table:
    return Table(
        heads=("Term", "Model", "Why", "Estimated contribution"),
        rows=[(r["term"], r["model"], r["why"], percent(r.get("estimated_contribution"))) for r in rows],
        style="",
    )


def _scene_groups(rows: list[Record]) -> list[tuple[str, list[Record]]]:
    told = ({**row, "value": _as_known(row)} for row in rows)
    return [(name, list(group)) for name, group in groupby(told, key=lambda row: row["group"])]


def _as_known(row: Record) -> str:
    """A value of the scene; one that the program supplied has no more digits than its uncertainty leaves."""
    text: str = row["value"]
    value, width = _LEADING.match(text), _LEADING.match(row["uncertainty"])
    if row["origin"] != "default" or value is None or width is None:
        return text
    share = 0.01 * float(value[0]) if row["uncertainty"].endswith("%") else 1.0
    known, _, _ = measured(float(value[0]), share * float(width[0])).partition(PLUS_MINUS)
    return known + text[value.end() :]


def _mesh_facts(mesh: Record) -> Facts:
    """Of a sector's mesh its quality too; that of an imported chamber is checked as it is read."""
    quality = (
        ("Smallest scaled Jacobian", "minimum_scaled_jacobian"),
        ("Largest aspect ratio", "largest_aspect"),
    )
    return (
        ("Cells of the 3-D pressure mesh", " × ".join(str(count) for count in mesh["cells"])),
        ("Unknowns", number(mesh["unknowns"], digits=6)),
        *((label, number(mesh[key], digits=3)) for label, key in quality if key in mesh),
        ("Solver", mesh["status"]),
    )


def _version_facts(evidence: Record) -> Facts:
    seeds = ", ".join(f"{name} {value}" for name, value in evidence["seeds"].items())
    scene = evidence["scene"]
    hashes = (
        ("Scene file (SHA-256)", scene["sha256"]),
        ("Scene values (SHA-256), by which cases name their scene", scene["values_sha256"]),
        ("Seeds", seeds),
    )
    return (*hashes, *evidence["versions"].items())


@dataclass(frozen=True, kw_only=True)
class PageContent:
    """Everything that the templates need."""

    context: Record
    drawings: tuple[Drawing, ...]
    """Every figure on the page, for files of their own."""


def case_views(cases: list[Record]) -> Record:
    """What the page shows of the cases but the second balancer's, by id."""
    evidence = {"verification": cases}
    return {case["id"]: case_view(case) for case in (*summary.claims(evidence), *summary.checks(evidence))}


def page_content(
    evidence: Record,
    *,
    pictures: Mapping[str, bytes] | None = None,
    views_of: Callable[[list[Record]], Record] = case_views,
    sections_by: Callable[[Record], Mapping[str, Record | None]] = section_views,
) -> PageContent:
    """Turn the evidence into texts, tables and figures.

    Args: `pictures`: PNG bytes by the file names that the evidence lists; a picture that is missing is left
    out. `views_of`, `sections_by`: what `case_views` and `section_views` answer, perhaps made by another
    process while this one draws the rest.
    Raises: KeyError: an evidence document that lacks a part.
    """
    if evidence.get("balancer") == BALANCER:
        sections = viewed(evidence, sections_by(evidence))
        return PageContent(context=_frame(evidence, sections), drawings=tuple(drawings_in(sections)))
    figures = chamber_figures(evidence) | tube_figures(evidence) | loop_figures(evidence)
    sections = viewed(evidence, sections_by(evidence))
    views = views_of(evidence["verification"])
    claims = [
        {**views[case["id"]], "elsewhere": summary.elsewhere(case, evidence)}
        for case in summary.claims(evidence)
    ]
    checks = [views[case["id"]] for case in summary.checks(evidence)]
    calibration, runs = evidence["calibration"], evidence["closed_loop"]
    context = {
        **_frame(evidence, sections),
        "tallies": _tallies(evidence),
        "causes": summary.common_causes(summary.claims(evidence)),
        "equations": _equations(),
        "figures": figures,
        "pictures": _pictures(evidence["pictures"], pictures or {}),
        "chamber": _chamber_table(calibration["chamber"]),
        "drag_at": _drag_table(calibration["tube"], evidence["operating_point"]),
        "injections": _injections(runs.get("calibrated")),
        "loop_notes": _loop_notes(runs),
        "claims": claims,
        "checks": checks,
        "order_plots": [case["order_plot"] for case in checks if case["order_plot"]],
        "models": _models(calibration["models_used"]),
        "mesh_facts": _mesh_facts(evidence["pressure"]["mesh"]),
    }
    own = [[case["order_plot"], *case["drawings"]] for case in (*claims, *checks)]
    drawings = drawings_in([figures, sections, *own])
    return PageContent(context=context, drawings=tuple(drawings))


def _frame(evidence: Record, sections: list[Record]) -> Record:
    """What the page of any scene has."""
    return {
        "e": placed(evidence),
        "known": partial(known_width, stated=states_uncertainty(evidence)),
        "named": partial(named_with_origin, evidence),
        "unstated": UNSTATED,
        "scene": evidence["scene"],
        "sections": sections,
        "stamp": _stamp(evidence),
        "running_head": _running_head(evidence),
        "scene_groups": _scene_groups(evidence["scene"]["table"]),
        "version_facts": _version_facts(evidence),
        "product": f"ringbalance {evidence['versions']['ringbalance']}",
    }


def _stamp(evidence: Record) -> Facts:
    return (
        ("Scene", evidence["scene"]["file"]),
        ("Hash", evidence["scene"]["sha256"][:12]),
        ("Effort", evidence["level"]),
        ("Date", evidence["times"]["date"]),
        ("ringbalance", evidence["versions"]["ringbalance"]),
    )


def _running_head(evidence: Record) -> str:
    scene = evidence["scene"]
    return f"{scene['name']}, scene {scene['sha256'][:12]}, {evidence['times']['date']}"


def _tallies(evidence: Record) -> Record:
    return {
        "lead": summary.lead_sentence(evidence),
        "claims": summary.verdict_counts(summary.claims(evidence), summary.CLAIM_VERDICTS),
        "checks": summary.verdict_counts(summary.checks(evidence), summary.CHECK_VERDICTS),
    }


def _equations() -> Record:
    return {
        name: {"svg": equation_svg(item.latex, item.words, f"eq-{name}"), "source": item.source}
        for name, item in equations().items()
    }


def _data_address(content: bytes) -> str:
    """A picture as part of the page, packed: a quarter of the bytes, and no difference to the eye."""
    packed = io.BytesIO()
    with Image.open(io.BytesIO(content)) as picture:
        picture.thumbnail((_PICTURE_WIDTH, _PICTURE_WIDTH))
        picture.save(packed, format="WEBP", quality=_PICTURE_QUALITY, method=_PICTURE_EFFORT)
    return "data:image/webp;base64," + base64.b64encode(packed.getvalue()).decode("ascii")


def _pictures(record: Record, contents: Mapping[str, bytes]) -> Record:
    """Pictures by name, with their bytes; one that lacks a variant is left out."""
    shown_pictures: Record = {"text": record["text"], "disc": None, "pressure": None, "tube": None}
    for item in record["files"]:
        if item["light"] in contents and item["dark"] in contents:
            variants = {key: _data_address(contents[item[key]]) for key in ("light", "dark")}
            shown_pictures[item["name"]] = {**item, **variants}
    return shown_pictures
