"""A scene file without errors becomes the frozen records that the other rooms read."""

from __future__ import annotations

from dataclasses import fields
from pathlib import PurePath
from typing import Any

from ringbalance.scene.eccentric_models import EccentricScene
from ringbalance.scene.keys.reading import Reading
from ringbalance.scene.keys.schema import ECCENTRIC_MASS
from ringbalance.scene.models import InputUncertainty, Scene
from ringbalance.scene.narrowing import AnyScene
from ringbalance.scene.uncertain import UNCERTAIN_QUANTITIES


def built(reading: Reading, *, file: str, sha256: str) -> AnyScene:
    """Build the scene.

    Args: `reading`: complete and without errors. `file`: its file, as it was named. `sha256`: of the file's
        bytes.
    Returns: The scene, in SI.
    """
    parts: dict[str, Any] = {
        **_records(reading),
        "name": reading.values["name"],
        "tolerance": reading.values["accuracy.tolerance"],
        "source": PurePath(file).name,
        "file": file,
        "sha256": sha256,
        "defaulted": _defaulted(reading),
    }
    if reading.schema is ECCENTRIC_MASS:
        return EccentricScene(**parts)
    return Scene(**parts, uncertainty=_uncertainty(reading))


def _records(reading: Reading) -> dict[str, Any]:
    """A record of each table; its fields are named after keys, and an absent key is None."""
    values: dict[str, Any] = dict(reading.values)
    vibration = values.get("rotor.initial_vibration")
    if vibration is not None:
        values["rotor.initial_amplitude"] = vibration.amplitude
        values["rotor.initial_phase"] = vibration.phase
    return {
        name: table.record(
            **{field.name: values.get(f"{name}.{field.name}") for field in fields(table.record)}
        )
        for name, table in reading.schema.tables.items()
        if table.record is not None
    }


def _uncertainty(reading: Reading) -> tuple[InputUncertainty, ...]:
    given = ((key, reading.values.get(f"uncertainty.{key}")) for key in UNCERTAIN_QUANTITIES)
    return tuple(
        InputUncertainty(quantity=key, half_width=spread[0], relative=spread[1])
        for key, spread in given
        if spread is not None
    )


def _defaulted(reading: Reading) -> tuple[str, ...]:
    """Paths "table.key" whose value is a default; what was looked up for a known liquid is none."""
    return tuple(
        path
        for path in reading.values
        if not reading.given(path) and (not path.startswith("liquid.") or path == "liquid.dissolved_gas")
    )
