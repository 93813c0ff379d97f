"""Closed-loop runs of drawn devices of a liquid ring, each made once for all settings that are tried."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache, partial
from itertools import groupby, pairwise
from typing import Any, Final

import numpy as np

from ringbalance.controller.algorithms.law_based import controller_of
from ringbalance.controller.balancer import ARRAYS, WATCH_TIME_S, Draws, Outcomes, Settings
from ringbalance.controller.liquid_ring.devices import RingDevice, Spread, devices
from ringbalance.controller.liquid_ring.drying import part_per_gas
from ringbalance.controller.liquid_ring.plant import (
    corners_of,
    largest_pair_moments,
    moment_towards,
    unreachable_moment,
)
from ringbalance.controller.loop_plan import LoopPlan
from ringbalance.controller.loop_records import AT_REST, IDLE, NOTICEABLE_CHANGE, RISING
from ringbalance.controller.rotor import Rotors
from ringbalance.controller.simulation import Outcome, noise_floor
from ringbalance.controller.terms import dynamics_of, run_terms
from ringbalance.physics.gas import applied_pressure, chamber_pressures, compression_work, vented_pressure
from ringbalance.reduced_model.calibration import calibrated_model
from ringbalance.reduced_model.chamber.tilted_ring import check_ring
from ringbalance.reduced_model.crater import largest_ratio
from ringbalance.reduced_model.injection.dynamics import empty_plants, gives_forces
from ringbalance.reduced_model.injection.limits import hold_liquid, residual_fills, stalled_fills
from ringbalance.reduced_model.injection.moment import tabulate_moment
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.terms import HELD
from ringbalance.scene.arrays import ComplexArray, FloatArray, IntArray, Records
from ringbalance.scene.designs import Designs, alike
from ringbalance.scene.draws import noise_table
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import with_values_at

RELATIVE_ERROR: Final = 1e-4
"""Error allowed to one step of a run's states: an injection then ends within 1e-6 in fill of a single run's,
and within 3e-5 without inertia."""
MOST_SAMPLES: Final = 100_000
"""Largest number of samples of a run without a trace."""
_GROUPS: Final = (0, 4, 16, 32, 64)
"""Bounds, within each 64 consecutive numbers, of the groups of devices that are made together: a device has
the same bits whichever others are requested, and a design that fails on four devices needs no more.
"""
_CACHED_GROUPS: Final = 32
_OUT_OF_REACH: Final = 2.0
"""Ratio of the vibration that remains with chambers emptied to their residual fills to the limit, above which
a run need not be carried out: it does not settle, and would take its whole time limit.  Beyond the fill where
the gas stalls a long injection still moves some liquid."""


_ENDS: Final = (
    Outcome.SETTLED,
    Outcome.CAPACITY_EXCEEDED,
    Outcome.STALLED,
    Outcome.DRIFTING,
    Outcome.DIVERGING,
    Outcome.HOVERING,
    Outcome.GAS_TIME_TOO_SHORT,
    Outcome.TIME_LIMIT,
)
"""Possible ends of a run; the first that applies counts."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnRuns:
    """Runs of a scene's devices under a law, and all that they share."""

    scene: Scene
    model: BalancerModel
    spread: Spread
    limit: float
    """Amplitude to come below, m; the controller may rest at another."""
    rotors: Rotors | None = None
    """Rotors of the devices; None: their own, drawn."""
    bare: bool = False
    """True if the model's law has no uncertainties of the scene's inputs."""
    full: DrawnRuns | None = None
    """Runs with all of the liquid, which the controllers assume; None: these."""

    @cached_property
    def informed(self) -> BalancerModel:
        """Model with uncertainties of the scene's inputs, which the law-based algorithm needs."""
        return calibrated_model(self.scene, checked=False) if self.bare else self.model

    @cached_property
    def terms(self) -> tuple[str, ...]:
        """Names of the terms that the runs of all devices model."""
        return run_terms(scene=self.scene, model=self.model)

    def outcomes(
        self, settings: Sequence[Settings], draws: Draws, *, watch_time: float = WATCH_TIME_S
    ) -> tuple[Outcomes, ...]:
        """Outcomes of each setting.

        Args: `settings`: values of the gas pressure and of keys of [controller].
        Raises: SceneError: a rotor too slow to form a ring.
        """
        check_ring(self.scene)
        if not settings:
            return ()
        # Settings of one gas pressure and kind of controller run together.
        scenes = [with_values_at(self.scene, each) for each in settings]
        alike: dict[tuple[float, str], list[int]] = {}
        for number, each in enumerate(scenes):
            alike.setdefault((each.gas.pressure, each.controller.kind), []).append(number)
        plans, assumed = {}, self.full or self
        for (pressure, kind), indices in alike.items():
            model = assumed.informed if kind == "law_based" else assumed.model
            some = [with_values_at(assumed.scene, settings[i]) for i in indices]
            controllers = [controller_of(each, model, relative_error=RELATIVE_ERROR) for each in some]
            plan = LoopPlan.of(some, controllers, most_samples=MOST_SAMPLES, watch_time=watch_time)
            plan.loops["limit"] = self.limit
            plan.loops["time_limit"] = min(self.scene.run.time_limit, draws.deadline)
            plans[pressure, kind] = plan

        shape = len(settings), len(draws.numbers)
        numbers, ends = np.empty((len(ARRAYS), *shape)), np.empty(shape, dtype=np.int64)
        devices_run: list[RingDevice] = []
        for block, members in groupby(draws.numbers, _group):
            requested = list(members)
            columns = slice(len(devices_run), len(devices_run) + len(requested))
            for (pressure, kind), indices in alike.items():
                under = self._under(block, draws.devices, pressure)
                row_of = {each.number: row for row, each in enumerate(under.group.devices)}
                rows = np.array([row_of[number] for number in requested])
                numbers[:, indices, columns], ends[indices, columns] = under.ran(
                    plans[pressure, kind], rows, complete=draws.complete, limit=self.limit
                )
            devices_run += [under.group.devices[row] for row in rows]
        inputs = {
            name: np.array([each.inputs[name] for each in devices_run]) for name in devices_run[0].inputs
        }
        clipped = Counter(name for each in devices_run for name in each.clipped)
        return tuple(
            Outcomes(
                **dict(zip(ARRAYS, numbers[:, index], strict=True)),
                ended=tuple(str(_ENDS[end]) for end in ends[index]),
                numbers=draws.numbers,
                inputs=inputs,
                clipped=clipped,
            )
            for index in range(len(settings))
        )

    def device(self, number: int) -> RingDevice:
        """Device with a number."""
        block = _group(number)
        return self._devices(block)[block.index(number)]

    def least_fills(self, numbers: Sequence[int], pressure: float) -> FloatArray:
        """Least fills of driven chambers: by stall and by gas in the port, and by the latter alone.

        Args: `numbers`: those of the devices. `pressure`: gas pressure of the settings, gauge, Pa.
        Returns: shape (2, n).
        """
        rows = []
        for block, members in groupby(numbers, _group):
            under = self._under(block, True, pressure)
            at = {each.number: row for row, each in enumerate(under.group.devices)}
            rows.append(under.emptied[[at[number] for number in members]])
        return np.concatenate(rows).T

    def __getstate__(self) -> dict[str, Any]:
        """Fields without the caches."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def _devices(self) -> Callable[[range], tuple[RingDevice, ...]]:
        """Devices of some numbers; the last ones are cached, as a search runs the same again and again."""
        seed, rotors = self.scene.run.seed, self.rotors
        some = partial(devices, self.scene, self.model, self.spread, seed=seed, rotors=rotors)
        return lru_cache(_CACHED_GROUPS)(some)

    @cached_property
    def _groups(self) -> Callable[[range, bool, float], _Group]:
        """Cached function (numbers, true if drawn, gas pressure in Pa) that gives a group of devices."""

        def group(block: range, varied: bool, pressure: float) -> _Group:
            exact = RingDevice(
                number=0, scene=self.scene, model=self.model, speed=1.0, moment=1.0, inputs={}, clipped=()
            )
            some = self._devices(block) if varied else [replace(exact, number=number) for number in block]
            settings = replace(self.scene, gas=replace(self.scene.gas, pressure=pressure))
            scenes = [each.under(settings, of=self.scene) for each in some]
            noise = partial(noise_table, self.scene.run.seed, devices=varied)
            return _Group.of(some, scenes, modelled=self.terms, noise=noise)

        return lru_cache(_CACHED_GROUPS)(group)

    @cached_property
    def _under(self) -> Callable[[range, bool, float], _Under]:
        """Cached function (numbers, true if drawn, settings' gas pressure in Pa) that gives an `_Under`."""

        def under(block: range, varied: bool, pressure: float) -> _Under:
            stated = self.scene.gas.pressure
            # A law of velocities alone is tabulated for one pressure.
            group = self._groups(block, varied, stated if gives_forces(self.model.flow) else pressure)
            pressures = np.array([each.scene.gas.pressure for each in group.devices])
            return group.under(np.maximum(pressures + pressure - stated, 0.0))

        return lru_cache(_CACHED_GROUPS)(under)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Group:
    """Devices that are made together, with all that does not depend on the gas pressure."""

    devices: tuple[RingDevice, ...]
    """Devices of the group; those that differ in numerical values alone are adjacent."""
    scenes: tuple[Scene, ...]
    kinds: tuple[tuple[slice, Scene], ...]
    """Rows of devices that differ in numerical values alone, and these as one scene."""
    plants: Records
    """Type `PLANT`."""
    fields: Mapping[str, Any]
    """Fields of their runs, shape (n,)."""
    held: bool
    """True if an empty tube fills up to its crest before liquid passes."""
    noise: Callable[[int], FloatArray]

    @classmethod
    def of(
        cls, devices: Sequence[RingDevice], scenes: Sequence[Scene], *, modelled: Sequence[str], noise: Any
    ) -> _Group:
        """Make a group. Args: `scenes`: those of the devices as run. `noise`: as `noise_table`, by number."""
        order = alike(scenes)
        indices = [index for kind in order for index in kind]
        some, scenes = tuple(devices[index] for index in indices), [scenes[index] for index in indices]
        plants, edges = empty_plants(len(some)), np.cumsum([0, *map(len, order)]).tolist()
        # The liquid held in the tube follows from the other terms, for all devices at once.
        before = [term for term in modelled if term != HELD]
        for row, (device, scene) in enumerate(zip(some, scenes, strict=True)):
            total = 2 * scene.disc.initial_fill
            dynamics = dynamics_of(scene=scene, model=device.model, modelled=before, checked=True)
            dynamics.fill(plants[row : row + 1], total=total, relative_error=RELATIVE_ERROR)
            tabulate_moment(plants[row], device.model, total=total)
        return cls(
            devices=some,
            scenes=tuple(scenes),
            kinds=tuple(
                (slice(*ends), Designs.stacked(scenes[slice(*ends)]).scene) for ends in pairwise(edges)
            ),
            plants=plants,
            fields={
                "plant": np.arange(len(some)),
                "speed": np.array([each.speed for each in some]),
                "start": np.array([each.rotor_as_read.initial_vibration for each in scenes]),
                "gain": np.array([each.rotor.influence for each in scenes]),
                "noise_floor": np.array([noise_floor(each) for each in scenes]),
            },
            held=HELD in modelled,
            noise=partial(noise, tuple(each.number for each in some)),
        )

    def under(self, pressures: FloatArray) -> _Under:
        """The devices under gas pressures, Pa."""
        plants, residual, stalled = self.plants, np.zeros(pressures.size), np.zeros(pressures.size)
        for rows, kind in self.kinds:
            designs = Designs.of(kind, {"gas.pressure": pressures[rows]})
            gas, liquid = designs.scene.gas, designs.scene.liquid
            plants["gas_pressure"][rows] = applied_pressure(gas)
            plants["supply_pressure"][rows] = gas.pressure + gas.ambient_pressure
            if gas.leak_from_supply is not None:
                plants["ambient_pressure"][rows] = chamber_pressures(gas)[1]
                plants["vapour_pressure"][rows] = liquid.vapour_pressure - vented_pressure(designs.scene)
            if self.held:
                hold_liquid(plants[rows], designs)
            residual[rows] = residual_fills(plants[rows], designs)
        stalled_fills(plants, stalled)
        unbalance = [each.rotor.initial_unbalance for each in self.scenes]
        as_read = np.array([each.rotor_as_read.initial_unbalance for each in self.scenes])
        sizes = np.array([abs(each) for each in unbalance])
        towards = np.array([-each / abs(each) if each else 1.0 for each in unbalance])
        factors = np.array([each.moment for each in self.devices])
        influence = np.array([each.rotor.influence_coefficient for each in self.scenes])
        disc = self.scenes[0].disc
        total = 2 * disc.initial_fill
        emptied = np.stack([np.minimum(np.maximum(residual, stalled), total / 2), residual], axis=1)
        moments = [
            largest_pair_moments(each.model, total=total, least_fill=least)
            for each, least in zip(self.devices, emptied, strict=True)
        ]
        usable, beyond = corners_of(np.stack(moments, axis=1), disc.chambers)
        supplied = [
            replace(each, gas=replace(each.gas, pressure=pressure))
            for each, pressure in zip(self.scenes, pressures.tolist(), strict=True)
        ]
        parts = [part_per_gas(s, device.model) for s, device in zip(supplied, self.devices, strict=True)]
        work = partial(compression_work, pressure_volume=1.0)
        pressed = [(each.gas.pressure, each.gas.ambient_pressure) for each in supplied]
        return _Under(
            group=self,
            supply=pressures,
            changed={name: plants[name].copy() for name in _CHANGED},
            residual=residual,
            emptied=emptied,
            unreachable=unreachable_moment(usable, -as_read) * influence,
            beyond_disc=unreachable_moment(beyond, -as_read) * influence,
            runout=np.array([each.sensor.runout for each in self.scenes]),
            usable_moment=factors * moment_towards(usable, towards),
            unbalance=factors * sizes,
            part_per_gas=np.array(parts),
            work=np.array([work(pressure=p + a, ambient_pressure=a) for p, a in pressed]),
        )


_PRESSURES: Final = ("gas_pressure", "supply_pressure", "ambient_pressure", "vapour_pressure")
_CHANGED: Final = (*_PRESSURES, "lift_straight", "lift_entrance")
"""Fields of a plant that the gas pressure changes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Under:
    """A group under gas pressures of its devices; arrays of shape (n,)."""

    group: _Group
    supply: FloatArray
    """Gas pressure of the supply, gauge, Pa."""
    changed: Mapping[str, FloatArray]
    residual: FloatArray
    """Fill of a driven chamber at which gas enters its port."""
    emptied: FloatArray
    """Least fill of a driven chamber by stall and gas in its port, and by the latter alone, shape (n, 2)."""
    unreachable: FloatArray
    """Reading that remains with the best fills that the gas can reach, m."""
    beyond_disc: FloatArray
    """Reading that remains if the gas can empty each chamber to its residual fill, m."""
    runout: ComplexArray
    """Vector by which a reading differs from the rotor's vibration, m."""
    usable_moment: FloatArray
    """Usable moment in the direction of the device's own unbalance, kg m."""
    unbalance: FloatArray
    """Unbalance of the rotor, kg m."""
    part_per_gas: FloatArray
    """Part of all liquid that gas carries off at most, over the p V of the gas."""
    work: FloatArray
    """Least work of compressing the gas, over its p V."""

    def ran(
        self, plan: LoopPlan, rows: IntArray, *, complete: bool, limit: float
    ) -> tuple[FloatArray, IntArray]:
        """Results of runs of some devices, shape (`ARRAYS`, settings, rows), and indices into `_ENDS`."""
        shape, group = (plan.loops.size, rows.size), self.group
        numbers, ends = np.empty((len(ARRAYS), *shape)), np.empty(shape, dtype=np.int64)
        # Devices whose reading cannot come to the limit: the least vibration of the rotor with the best one.
        least = np.abs(self.unreachable - np.abs(self.runout))
        numbers[0], numbers[1], numbers[2] = math.inf, least[rows], math.nan
        numbers[3], numbers[4], ends[...] = self.usable_moment[rows], self.unbalance[rows], 1
        numbers[5:] = math.nan
        carried = complete | (self.beyond_disc[rows] <= _OUT_OF_REACH * limit)
        if not carried.any():
            return numbers, ends
        rows = rows[carried]
        for name, values in self.changed.items():
            group.plants[name] = values
        fields = {**group.fields, "residual_fill": self.residual}
        runs = plan.runs(rows.size, **{name: values[rows] for name, values in fields.items()})
        plan.carry(runs, group.plants, group.noise)
        runs = runs.reshape(plan.loops.size, rows.size)
        held = runs["settled"] > 0
        settled = held | ((runs["cause"] == AT_REST) & (runs["since"] < math.inf))
        since = np.where(held, runs["held_since"], runs["since"])
        numbers[0][:, carried] = np.where(settled, since, math.inf)
        runout = self.runout[rows]
        of_rotor = np.abs(runs["vibration"] - runout)
        numbers[1][:, carried] = np.where(runout == 0.0, runs["amplitude"], of_rotor)
        seeps = group.plants["leak_from_supply"] * group.plants["supply_pressure"]
        seeped = group.scenes[0].disc.chambers * seeps[rows] * runs["time"]
        numbers[2][:, carried] = (runs["gas"] + seeped) * self.work[rows]
        numbers[6][:, carried] = (runs["gas"] - runs["leaked"]) * self.part_per_gas[rows]
        if group.scenes[0].disc.gas_hole_diameter is not None:
            numbers[5][:, carried] = self._crater(runs["least_driven"], rows)
        shown = (
            settled,
            self.beyond_disc[rows] > limit,
            self.unreachable[rows] > limit,
            (runs["drains"] > 0) | (runs["drift"] > NOTICEABLE_CHANGE),
            runs["cause"] == RISING,
            runs["lost"] > 0,
            runs["cause"] == IDLE,
            True,
        )
        ends[:, carried] = np.argmax([np.broadcast_to(each, settled.shape) for each in shown], axis=0)
        return numbers, ends

    def _crater(self, fills: FloatArray, rows: IntArray) -> FloatArray:
        """Part of the ring's depth that the gas jet digs, zero where no valve opened.

        Args: `fills`: of the driven chambers, shape (settings, rows).
        """
        ratios = np.full((len(fills), len(self.group.devices)), math.inf)
        ratios[:, rows] = fills
        for each, kind in self.group.kinds:
            designs = Designs.of(kind, {"gas.pressure": self.supply[each]})
            ratios[:, each] = largest_ratio(designs.scene, ratios[:, each])
        return ratios[:, rows]


def _group(number: int) -> range:
    """Numbers of the devices that are made together with one."""
    start, within = number - number % _GROUPS[-1], number % _GROUPS[-1]
    after = next(each for each in range(len(_GROUPS)) if _GROUPS[each] > within)
    return range(start + _GROUPS[after - 1], start + _GROUPS[after])
