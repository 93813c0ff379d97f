"""The evidence document of a scene with two eccentric masses."""

from __future__ import annotations

from datetime import date
from typing import Any

from ringbalance.controller.eccentric_mass.scene_records import ECCENTRIC_MASS, EccentricScene, SpeedPoint
from ringbalance.controller.eccentric_mass.study import eccentric_study
from ringbalance.reports.evidence import FORMAT, Progress, cases_of_report, scene_record
from ringbalance.reports.provenance import provenance, versions
from ringbalance.reports.section import Record
from ringbalance.results.numbers import given, short, with_unit
from ringbalance.scene.keys.declaration import Key, keys_of
from ringbalance.scene.keys.fields import Reader
from ringbalance.scene.origins import InputUncertainty
from ringbalance.scene.platform.processes import Workers
from ringbalance.scene.units import DIMENSIONS
from ringbalance.verification.catalogue import load_cases
from ringbalance.verification.evidence import Level
from ringbalance.verification.runner import DRIVEN, paper_scene


def collect_eccentric(
    scene: EccentricScene,
    *,
    level: Level = "light",
    scene_text: str = "",
    pool: Workers | None = None,
    progress: Progress | None = None,
) -> Record:
    """Run the scene, balanced and with its masses locked, and judge its loops and the claims of its paper.

    Raises: SceneError: a run that takes too many samples or steps.
    """
    tell = progress or (lambda _: None)
    ids = [case.id for case in load_cases() if case.paper == DRIVEN]
    with cases_of_report(ids, scene=paper_scene(), level=level, pool=pool) as judged_cases:
        tell("balanced and locked run")
        study = eccentric_study(scene).document()
        verification, kept = judged_cases(tell)
    run = study.pop("run")
    return {
        "format": FORMAT,
        "level": level,
        "balancer": scene.balancer,
        "versions": versions(),
        "scene": scene_record(scene, scene_text, parameters(scene)),
        "seeds": {"run": scene.run.seed},
        "truth": {
            "unbalance_kg_m": scene.imbalance.mass * scene.imbalance.radius,
            "phase_rad": scene.imbalance.phase,
            "friction_arm_m": list(scene.masses.friction_arm),
        },
        "closed_loop": {"balanced": run},
        **study,
        "verification": verification,
        "provenance": provenance(),
        "pictures": {"drawn": True, "text": "", "files": []},
        "times": {"date": date.today().isoformat(), "kept_cases": kept},
    }


def parameters(scene: EccentricScene) -> list[Record]:
    """Every value of a scene with its uncertainty, meaning and origin, as rows of a table."""
    widths = {each.quantity: _width(each) for each in scene.uncertainty}
    return [
        {
            "group": name.replace("_", " ").capitalize(),
            "quantity": key.replace("_", " "),
            "value": _value(value, entry, scene.origin_of(f"{name}.{key}")),
            "uncertainty": widths.get(f"{name}.{key}", ""),
            "note": entry.presence.meaning,
            "origin": scene.origin_of(f"{name}.{key}"),
            "path": f"{name}.{key}",
        }
        for name, table in ECCENTRIC_MASS.tables.items()
        if table.record is not None
        for key, entry in keys_of(table.record).items()
        if (value := getattr(getattr(scene, name, None), key, None)) not in (None, ())
    ]


def _value(value: Any, entry: Key, origin: str) -> str:
    """As the file has it; a default in the words of its declaration, or as it follows from other values."""
    if origin != "default":
        return _written(value, entry.takes)
    if entry.presence.kind != "standard":
        return _written(value, entry.takes, digits=3)
    texts = entry.presence.default if isinstance(entry.presence.default, list) else [entry.presence.default]
    return ", ".join(str(text).replace("*", " ") for text in texts)


def _width(uncertain: InputUncertainty) -> str:
    if uncertain.relative:
        return with_unit(short(100 * uncertain.half_width), "%")
    table, key = uncertain.quantity.split(".")
    record = ECCENTRIC_MASS.tables[table].record
    return _written(uncertain.half_width, keys_of(record)[key].takes) if record else ""


def _written(value: Any, takes: object, *, digits: int = 6) -> str:
    if isinstance(value, tuple):
        return ", ".join(_written(item, takes, digits=digits) for item in value)
    if isinstance(value, SpeedPoint):
        return f"{given(value.speed, 'rad/s')} from {given(value.time, 's')}"
    if isinstance(value, bool | str):
        return str(value)
    dimension = takes.dimension if isinstance(takes, Reader) else None
    unit = next(iter(DIMENSIONS[dimension].units)).replace("*", " ") if dimension else ""
    return given(value, unit, digits=digits) if unit else short(float(value), digits=digits)
