"""A scene file without faults becomes the frozen records that the other rooms read."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, TypeVar

from ringbalance.scene.models import (
    Bend,
    ControllerSettings,
    Disc,
    Environment,
    Gas,
    InputUncertainty,
    Liquid,
    Rotor,
    RunSettings,
    Scene,
    Sensor,
    Tube,
)
from ringbalance.scene.reading import Reading
from ringbalance.scene.uncertain import UNCERTAIN

Record = TypeVar("Record")


def built(reading: Reading, *, source: str, sha256: str) -> Scene:
    """Build the scene.

    Args:
        reading: complete and without faults.
        source: file name without its folder.
        sha256: of the file's bytes.

    Returns:
        The scene, in SI.
    """
    values = reading.values
    vibration = values["rotor.initial_vibration"]
    bends = tuple(Bend(angle=bend.angle, radius=bend.radius) for bend in values["tube.bends"])
    return Scene(
        name=values["name"],
        disc=record(Disc, reading, "disc"),
        liquid=record(Liquid, reading, "liquid"),
        tube=record(Tube, reading, "tube", bends=bends),
        gas=record(Gas, reading, "gas"),
        environment=record(Environment, reading, "environment"),
        rotor=record(
            Rotor,
            reading,
            "rotor",
            initial_amplitude=vibration.amplitude,
            initial_phase=vibration.phase,
        ),
        sensor=record(Sensor, reading, "sensor"),
        controller=record(ControllerSettings, reading, "controller"),
        uncertainty=_uncertainty(reading),
        run=record(RunSettings, reading, "run"),
        tolerance=values["accuracy.tolerance"],
        source=source,
        sha256=sha256,
        defaulted=defaulted(reading),
    )


def record(kind: type[Record], reading: Reading, table: str, **others: Any) -> Record:
    """Fill a record from the table whose keys its fields are named after; an absent key is None.

    Args:
        kind: the record.
        reading: complete and without faults.
        table: name of the table.
        others: fields that are no keys, or need more than their key's value.

    Returns:
        The record.
    """
    names = [field.name for field in fields(kind)]  # type: ignore[arg-type]
    values = {name: reading.values.get(f"{table}.{name}") for name in names}
    return kind(**{**values, **others})


def _uncertainty(reading: Reading) -> tuple[InputUncertainty, ...]:
    given = ((key, reading.values.get(f"uncertainty.{key}")) for key in UNCERTAIN)
    return tuple(
        InputUncertainty(quantity=key, half_width=spread[0], relative=spread[1])
        for key, spread in given
        if spread is not None
    )


def defaulted(reading: Reading) -> tuple[str, ...]:
    """List the paths whose value is a default; what was looked up for a known liquid is none.

    Args:
        reading: complete and without faults.

    Returns:
        Paths, "table.key".
    """
    return tuple(
        path for path in reading.values if not reading.given(path) and not path.startswith("liquid.")
    )
