"""The tables of a scene file with eccentric masses; loaded for such a file only."""

from __future__ import annotations

from ringbalance.scene import eccentric_control_models as control
from ringbalance.scene import eccentric_models as machine
from ringbalance.scene.keys.declaration import needed
from ringbalance.scene.keys.schema import Schema, Table

_ECCENTRIC = {
    "rotor": Table.of(machine.EccentricRotor, "the rotor on its bearing, and its speed"),
    "imbalance": Table.of(machine.Imbalance, "the imbalance to be balanced"),
    "masses": Table.of(machine.EccentricMasses, "the two eccentric masses on their track"),
    "motor": Table.of(machine.Motor, "motor and gears of each mass"),
    "sensor": Table.of(machine.EccentricSensor, "the sensors; exact when left out"),
    "imbalance_filter": Table.of(control.ImbalanceFilter, "the Kalman filter that finds the imbalance"),
    "friction_filter": Table.of(control.FrictionFilter, "the extended Kalman filter that finds the friction"),
    "lqr": Table.of(control.Lqr, "the regulator that moves the masses"),
    "fine_tuning": Table.of(control.FineTuning, "the search by trial for a smaller vibration"),
    "supervisor": Table.of(control.Supervisor, "the order of the stages, and when each ends"),
}
ECCENTRIC_MASS = Schema.of(
    _ECCENTRIC,
    balancer=needed('"eccentric_mass" for eccentric masses'),
    scene=machine.EccentricScene,
)
"""A scene whose balancer is two eccentric masses."""
