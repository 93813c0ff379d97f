"""What a run costs in compressed gas, and how much of it passed through chambers that had run dry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ringbalance.controller.liquid_ring.opening import NEAR_RESIDUAL
from ringbalance.controller.liquid_ring.plant import Operation
from ringbalance.physics.gas import GasLine, compression_work, normal_volume, nozzle_flow
from ringbalance.reduced_model.law.model import BalancerModel
from ringbalance.reduced_model.operating.residual import residual_fill_ratio
from ringbalance.scene.models import Scene

_LITRE = 1e-3


@dataclass(frozen=True, kw_only=True)
class GasUse:
    """Gas of a run."""

    fillings: int
    normal_volume: float
    """Gas from the supply: what the chambers held above ambient pressure when their valves closed, all of
    which is vented, and gas that passed through, normal m^3."""
    energy: float
    """Least work that compresses it, p V ln(p_1/p_a) a filling, J."""
    run_dry: int
    """Injections that ran their chamber dry."""
    passed_through: float
    """Upper bound on the gas that passed through those, normal m^3; part of `normal_volume`."""
    residual_fill_ratio: float
    """Fill of a driven chamber below which gas enters its port."""
    below_residual: int
    """Injections that left their chamber below it, those that ran it dry included."""

    @property
    def text(self) -> str:
        """Consumption in one phrase."""
        litres = self.normal_volume / _LITRE
        work = f"{self.energy / 1e3:.1f} kJ of compression"
        return f"{litres:.1f} normal litres, {work} in {self.fillings} fillings"

    @property
    def warning(self) -> str:
        """Empty when no gas entered a port."""
        if not self.below_residual:
            return ""
        dry = (
            f", {self.run_dry} of them ran it dry: up to {self.passed_through / _LITRE:.3g} normal litres of "
            "gas passed through the tube into the opposite chamber"
            if self.run_dry
            else ""
        )
        return (
            f"{self.below_residual} of {self.fillings} injections left their chamber below a fill ratio of "
            f"{self.residual_fill_ratio:.3g}, where gas enters the port{dry}; open the valve for less time "
            "or fill in more liquid"
        )

    @classmethod
    def of(cls, *, scene: Scene, model: BalancerModel, operations: Sequence[Operation]) -> GasUse:
        """Gas consumption of the operations of a run.

        Gas through a chamber that has run dry is bounded by a choked nozzle of the tube's section and by the
        line.
        Source: (p_1 - p_a) V of each filling at closing; `compression_work`, `nozzle_flow`.
        """
        gas = scene.gas
        supply = gas.pressure + gas.ambient_pressure
        through = nozzle_flow(pressure=supply, area=model.tube_area, temperature=gas.temperature)
        line = GasLine.of(gas)
        if line is not None:
            # Filled volume over the time constant is the most that the line passes.
            through = min(through, supply / line.time_constant(volume=1.0))
        passed = through * math.fsum(operation.run_dry for operation in operations)
        dead = gas.dead_volume or 0.0
        content = math.fsum(
            # A vented chamber is full of ambient gas, which no supply has to deliver.
            done.closing_pressure * ((1 - done.fill_after) * model.chamber_volume + dead)
            for done in operations
        )
        total = content + passed
        residual = residual_fill_ratio(scene, law=model.flow)
        return cls(
            fillings=len(operations),
            normal_volume=normal_volume(pressure_volume=total, temperature=gas.temperature),
            energy=compression_work(
                pressure_volume=total, pressure=supply, ambient_pressure=gas.ambient_pressure
            ),
            run_dry=sum(operation.run_dry > 0 for operation in operations),
            residual_fill_ratio=residual,
            below_residual=sum(
                done.run_dry > 0 or done.fill_after < residual - NEAR_RESIDUAL for done in operations
            ),
            passed_through=normal_volume(pressure_volume=passed, temperature=gas.temperature),
        )
