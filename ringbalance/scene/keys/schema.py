"""Tables of a scene file, from the keys that records declare."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

from ringbalance.scene import loop_models, models
from ringbalance.scene.chamber_file.record import MeshKeys
from ringbalance.scene.design_settings import DesignSettings
from ringbalance.scene.fitted import Fitted
from ringbalance.scene.keys.declaration import Entries, Key, Presence, derived, keys_of, standard, unused
from ringbalance.scene.keys.fields import Bounds, choice, half_width, one_of, share, text
from ringbalance.scene.origins import Measured, Origin
from ringbalance.scene.registry import known_balancers

KeyPath = tuple[int | str, ...]
ORIGIN = "origin"
"""Key of every table for the origin of its values."""
_UNCERTAINTY = "expanded uncertainties (95 %) of the inputs"


@dataclass(frozen=True, kw_only=True)
class TableSchema:
    """One table of a scene file."""

    text: str
    keys: Mapping[str, Key]
    record: type | None = None
    """Record that the table is read into; None when its values are in other fields of the scene."""

    @classmethod
    def of(cls, record: type, text: str) -> TableSchema:
        """A table that is read into a record. Args: `text`: its description."""
        return cls(text=text, keys=keys_of(record), record=record)


@dataclass(frozen=True, kw_only=True)
class Schema:
    """Keys and tables of a kind of scene file."""

    top: Mapping[str, Key]
    """Keys before the first table."""
    tables: Mapping[str, TableSchema]
    scene: Callable[..., Any]
    """Record that all tables are read into."""

    @cached_property
    def following(self) -> tuple[tuple[str, Presence], ...]:
        """Path and presence of each key whose default is derived from other values, in order."""
        return tuple(
            (f"{name}.{key}", declared.presence)
            for name, table in self.tables.items()
            for key, declared in table.keys.items()
            if declared.presence.needs
        )

    @cached_property
    def needed(self) -> Mapping[str, tuple[str, ...]]:
        """Keys that every scene must have, by table."""
        return MappingProxyType(
            {
                name: tuple(key for key, declared in table.keys.items() if declared.presence.kind == "needed")
                for name, table in self.tables.items()
            }
        )

    def key_at(self, steps: KeyPath) -> Key:
        """The key at a path of table, key and so on; indices of list entries are ignored."""
        *tables, name = (step for step in steps if isinstance(step, str))
        return self.keys_in(tables)[name] if tables else self.top[name]

    def names_at(self, steps: KeyPath) -> list[str]:
        """Names that can stand in the table at a path; at the top those of keys and tables."""
        tables = [step for step in steps if isinstance(step, str)]
        return list(self.keys_in(tables)) if tables else [*self.top, *self.tables]

    def keys_in(self, steps: Sequence[str]) -> Mapping[str, Key]:
        """Keys of the table at a path; none where there is no table."""
        keys = self.tables[steps[0]].keys if steps[0] in self.tables else {}
        for step in steps[1:]:
            takes = keys[step].takes if step in keys else None
            keys = takes.keys if isinstance(takes, Entries) else {}
        return keys

    @classmethod
    def of(
        cls,
        tables: Mapping[str, TableSchema],
        *,
        balancer: Presence,
        scene: Callable[..., Any],
        uncertainty: TableSchema | None = None,
    ) -> Schema:
        """The schema of a kind of balancer, with the keys of every scene file.

        Args: `balancer`: rule when that key is absent. `uncertainty`: that table; by default it has
            a subtable of half-widths for each table, for tables that share names of keys.
        """
        if uncertainty is None:
            by_table = {}
            for name, table in tables.items():
                inside = {
                    key: _half_width_of(name, each) for key, each in table.keys.items() if each.uncertain
                }
                if inside:
                    presence = unused("exact", f"expanded uncertainties of quantities in [{name}]")
                    by_table[name] = Key(
                        takes=Entries(record=dict, keys=inside, example=""), presence=presence
                    )
            uncertainty = TableSchema(text=_UNCERTAINTY, keys=by_table)
        origin = Key(takes=choice(Origin), presence=unused("given", "where the value comes from"))
        with_origins = {}
        for name, table in {**tables, "uncertainty": uncertainty, **_RUN}.items():
            origins = Key(
                takes=Entries(record=dict, keys=dict.fromkeys(table.keys, origin), example=""),
                presence=unused("every value that stands here is given", "where values come from, by key"),
            )
            with_origins[name] = replace(table, keys={**table.keys, ORIGIN: origins})
        top = {
            "name": Key(takes=text(), presence=derived("the file's name", "title of the scene")),
            "balancer": Key(takes=one_of(known_balancers), presence=balancer),
        }
        return cls(top=MappingProxyType(top), tables=MappingProxyType(with_origins), scene=scene)


def _half_width_of(table: str, key: Key) -> Key:
    rule = "that of the known liquid" if table == "liquid" else "exact"
    return Key(
        takes=half_width(key.takes.dimension),
        presence=unused(rule, f"expanded uncertainty of the quantity in [{table}]"),
    )


_TOLERANCE = Key(
    takes=share(Bounds(above=0, below=1), example=0.01),
    presence=standard("1 %", "relative bound on discretisation, for meshes and gravity in finite elements"),
)
_RUN = {
    "run": TableSchema.of(loop_models.RunSettings, "a simulation's seed and end"),
    "accuracy": TableSchema(text="what is asked of the result", keys={"tolerance": _TOLERANCE}),
    "fitted": TableSchema.of(
        Fitted,
        "joint uncertainty that a fit leaves: standard deviations of the values in this file, and their "
        "correlations; `ringbalance fit --save` writes it",
    ),
    "measured": TableSchema.of(
        Measured, "the measurements that `ringbalance fit` has fitted the scene to; `fit --save` writes it"
    ),
}


_VIBRATION = Key(
    takes=Entries(record=loop_models.Vibration, keys=keys_of(loop_models.Vibration), example=""),
    presence=standard(
        {"amplitude": "10 um", "phase": "90 deg"},
        "{ amplitude, phase } of the rotor itself before balancing, zero-to-peak",
    ),
)
_RUNOUT = Key(
    takes=Entries(record=loop_models.Runout, keys=keys_of(loop_models.Runout), example=""),
    presence=unused(
        "none",
        "{ amplitude, phase }: vector that the sensor shows beside the rotor's vibration, the same in every "
        "turn; a steady vibration from elsewhere at once per turn acts alike",
    ),
)
"""Keys whose entries are two fields of a record each."""
_LIQUID_RING = {
    # The dimensions of the chambers, or the mesh of one from which they follow.
    "disc": TableSchema(
        text="the balancing disc", keys={**keys_of(models.Disc), **keys_of(MeshKeys)}, record=models.Disc
    ),
    "liquid": TableSchema.of(models.Liquid, "the balancing liquid"),
    "tube": TableSchema.of(models.Tube, "the tube that connects two opposite chambers"),
    "gas": TableSchema.of(models.Gas, "the gas that drives the liquid"),
    "environment": TableSchema.of(loop_models.Environment, "gravity and how the shaft lies in it"),
    "rotor": TableSchema(
        text="the rotor as the balancer sees it",
        keys={**keys_of(loop_models.Rotor), "initial_vibration": _VIBRATION},
        record=loop_models.Rotor,
    ),
    "sensor": TableSchema(
        text="the vibration sensor; exact when left out",
        keys={**keys_of(loop_models.Sensor), "runout": _RUNOUT},
        record=loop_models.Sensor,
    ),
    "controller": TableSchema.of(loop_models.ControllerSettings, "the control algorithm"),
    "requirement": TableSchema.of(
        loop_models.RequirementSettings,
        "what is required of the balancer; reports compare it with what is reached",
    ),
    "design": TableSchema.of(DesignSettings, "what `ringbalance design` may choose"),
}
LIQUID_RING = Schema.of(
    _LIQUID_RING,
    balancer=standard("liquid_ring", "kind of balancer"),
    uncertainty=TableSchema(
        text=_UNCERTAINTY,
        keys={
            name: _half_width_of(table, key)
            for table, content in _LIQUID_RING.items()
            for name, key in content.keys.items()
            if key.uncertain
        },
    ),
    scene=models.Scene,
)
"""A scene whose balancer is a liquid ring."""
