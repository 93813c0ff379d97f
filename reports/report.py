"""The whole report: evidence, figures, fields, pictures and pages, put in place once all are complete."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import product
from pathlib import Path
from typing import Final

import numpy as np

from ringbalance.reports.evidence import Progress, collect_evidence
from ringbalance.reports.figures_page import READING_FILE
from ringbalance.reports.page import DOCUMENTS, page_content, render_pages, terminal_lines
from ringbalance.reports.pages.cases import TABLES, is_long, table_file
from ringbalance.reports.pages.first_page import SECTION as SUMMARY
from ringbalance.reports.pages.first_page import pressure_page
from ringbalance.reports.pages.standing import evidence_text
from ringbalance.reports.pictures.opengl import OpenGL
from ringbalance.reports.pictures.process import FOLDERS, drawing_beside
from ringbalance.reports.saved import saved_cases
from ringbalance.reports.section import Record, ring_of
from ringbalance.reports.sections import CASES_VIEW, sections_of, view_of
from ringbalance.results.result import csv_text
from ringbalance.scene import AnyScene
from ringbalance.scene.platform.files import staged
from ringbalance.scene.platform.jobs import Job, answers_of
from ringbalance.scene.platform.memory import seldom_collected
from ringbalance.scene.platform.processes import Workers, beside
from ringbalance.scene.registry import registered_or_none
from ringbalance.verification.evidence import Level
from ringbalance.verification.runner import paper_scene

FILES: Final = ("evidence.json", *DOCUMENTS)
"""Files of a report, in the order of writing; where the last, the page, exists, all others do."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """A finished report."""

    page: Path
    """report.html."""
    evidence: Record
    """Content of evidence.json."""

    @property
    def sound(self) -> bool:
        """False when a check of this program failed."""
        return not any(
            case.get("broken") or (case["kind"] == "code_verification" and case["verdict"] == "failed")
            for case in self.evidence["verification"]
        )

    @property
    def summary(self) -> list[str]:
        """Summary in a few sentences, and the reason where there are no pictures."""
        pictures = self.evidence["pictures"]
        return terminal_lines(self.evidence) + ([] if pictures["drawn"] else [pictures["text"]])


def _views(path: Path, balancer: str, pool: Workers | None) -> Iterator[tuple[str, Record | None]]:
    """Views of all sections and of the cases, by name. Args: `path`: file of the evidence."""
    # The cases have most figures.
    names = (CASES_VIEW, *sections_of(balancer))
    # Sections that a balancer brings itself may be unknown to other processes.
    beside_this = pool if registered_or_none("report", balancer) is None else None
    return answers_of([Job(name=name, do=partial(_view_at, name, path)) for name in names], beside_this)


def _view_at(name: str, path: Path) -> Record | None:
    return view_of(name, _read_at(path))


@lru_cache(maxsize=1)
def _read_at(path: Path) -> Record:
    document: Record = json.loads(path.read_bytes())
    return document


def write_report(
    scene: AnyScene,
    out: Path | str,
    *,
    level: Level = "light",
    scene_text: str = "",
    workers: int | Workers = 1,
    progress: Progress | None = None,
    opengl: OpenGL | None = None,
) -> Report:
    """Verify, calibrate, simulate and draw a scene into one folder.

    Args: `scene_text`: the scene file's own text, for the appendix. `workers`: processes, this one included,
    or those that are at work already.
    Raises: SceneError: a scene that cannot be calibrated or simulated; nothing is written.
    Raises: OSError: the folder cannot be written, or holds an evidence.json that is none; known before the
    work.
    """
    folder, start, report_progress = Path(out), time.perf_counter(), progress or (lambda _: None)
    saved, ring = saved_cases(folder), ring_of(scene)
    # Only a liquid ring has fields and pictures; they are drawn while the evidence is collected.
    no_pictures = nullcontext(lambda: {"drawn": True, "text": "", "files": []})
    with (
        seldom_collected(),
        staged(folder, files=FILES, folders=(*FOLDERS, TABLES)) as stage,
        beside(workers, loading=paper_scene) as pool,
        no_pictures if ring is None else drawing_beside(ring, stage, opengl) as finish_pictures,
    ):
        evidence = collect_evidence(
            scene, level=level, scene_text=scene_text, saved=saved, pool=pool, progress=report_progress
        )
        report_progress("pictures")
        evidence["pictures"] = finish_pictures()
        report_progress("page")
        evidence["times"]["total_s"] = round(time.perf_counter() - start, 1)
        path, figures, tables = stage / "evidence.json", stage / "figures", stage / TABLES
        path.write_text(evidence_text(evidence), encoding="utf-8")
        # The pages are made from the evidence as read back from its file.
        evidence = _read_at(path)
        views = dict(_views(path, evidence["balancer"], pool))
        figures.mkdir(exist_ok=True)
        names = [item[theme] for item in evidence["pictures"]["files"] for theme in ("light", "dark")]
        pictures = {name: (figures / name).read_bytes() for name in names}
        content = page_content(evidence, pictures=pictures, views=views)
        for drawing in content.drawings:
            (figures / f"{drawing.name}.svg").write_text(drawing.standalone(), encoding="utf-8")
        tables.mkdir()
        for name, text in _csv_tables(evidence).items():
            (tables / name).write_text(text, encoding="utf-8")
        pages = render_pages(content)
        pressures = (views[SUMMARY.name] or {}).get("pressure")
        if pressures is not None:
            pages = {READING_FILE: pressure_page(evidence, pressures), **pages}
        for name, page in pages.items():
            (stage / name).write_text(page, encoding="utf-8")
    return Report(page=folder / "report.html", evidence=evidence)


def _csv_tables(evidence: Record) -> dict[str, str]:
    """Contents of the files by name: tables of cases, the map of k, the operating map, the sampled loops.

    SI units, which stand in the heads. The same evidence gives the same bytes.
    """
    tables: dict[str, Record] = {
        table_file(case, table): {
            f"{name} [{table['units'].get(name, '1')}]": values for name, values in table["columns"].items()
        }
        for case in evidence["verification"]
        for table in case.get("tables") or []
        if is_long(table)
    }
    if drag := (evidence.get("fifty") or {}).get("map"):
        bores, viscosities = drag["bore_m"], drag["kinematic_viscosity_m2_s"]
        tables["map_of_k.csv"] = {
            "bore [m]": np.repeat(bores, len(viscosities)).tolist(),
            "kinematic viscosity [m^2/s]": np.tile(viscosities, len(bores)).tolist(),
            "k [1]": [k or None for k in np.ravel(drag["k"]).tolist()],
            "expanded uncertainty of k [1]": [k or None for k in np.ravel(drag["k_uncertainty"]).tolist()],
        }
    if operation := evidence.get("operation"):
        points = list(product(operation["gas_pressure_Pa"], operation["fill_ratio"]))
        tables["operating_map.csv"] = {
            "gas pressure [Pa]": [pressure for pressure, _ in points],
            "fill ratio [1]": [fill for _, fill in points],
            "regime": [operation["regimes"][int(sign)] for row in operation["regime"] for sign in row],
        }
    for law, run in evidence["closed_loop"].items():
        tables[f"loop_{law}.csv"] = {
            "time [s]": run["time_s"],
            "amplitude [m]": run["amplitude_m"],
            "phase [rad]": run.get("phase_rad") or [None] * len(run["time_s"]),
        }
    return {name: csv_text(columns) for name, columns in tables.items()}
