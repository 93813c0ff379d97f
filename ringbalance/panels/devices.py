"""Laws and constants of drawn devices, as the exported disc reads them, packed into text."""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from ringbalance.controller.judging.judge import FIRST_VERDICT_DEVICE
from ringbalance.controller.liquid_ring.balancer import LiquidRingBalancer
from ringbalance.controller.liquid_ring.loop_factor import loop_rate
from ringbalance.controller.terms import dynamics_of, run_terms
from ringbalance.export.blocks import Block, disc_block
from ringbalance.export.compact import CompactLaw, compact_law
from ringbalance.reduced_model.injection.pair import Injections
from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.reduced_model.law.flow_law import BalancerModel
from ringbalance.reduced_model.residual_liquid import residual_fill_ratio, stalled_fill_ratio
from ringbalance.reduced_model.terms import FILLING, LAG
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

PRESSURE_FACTORS: Final = (0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0)
"""Gas pressures, over the scene's, at which the fills are given to which chambers can be emptied."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PackedDevice:
    """One device: the exported disc of its law, and what the page's controls act on."""

    block: Block
    facts: Mapping[str, Any]
    """Vibration before balancing and runout, m, by components; gas pressure, gauge, Pa; least fills of a
    driven chamber at each of `PRESSURE_FACTORS`, by stall and gas in its port, and by the latter alone."""

    @classmethod
    def of(
        cls, scene: Scene, law: CalibratedLaw, compact: CompactLaw, *, least_fills: FloatArray
    ) -> PackedDevice:
        """Device of a scene. Args: `least_fills`: shape (2, pressures)."""
        vibration, runout = scene.rotor.initial_vibration, scene.sensor.runout
        return cls(
            block=disc_block(scene, law, compact=compact),
            facts={
                "vibration": [vibration.real, vibration.imag],
                "runout": [runout.real, runout.imag],
                "pressure": scene.gas.pressure,
                "least": np.round(least_fills, 6).tolist(),
            },
        )


def nominal_device(scene: Scene, law: CalibratedLaw, compact: CompactLaw) -> PackedDevice:
    """Device as the scene states it."""
    total, fills = 2 * scene.disc.initial_fill, []
    for factor in PRESSURE_FACTORS:
        gas = replace(scene.gas, pressure=factor * scene.gas.pressure)
        residual = residual_fill_ratio(replace(scene, gas=gas), law=law)
        stalled = stalled_fill_ratio(law=law, total=total, gas_pressure=gas.pressure)
        fills.append((min(max(residual, stalled), total / 2), residual))
    return PackedDevice.of(scene, law, compact, least_fills=np.array(fills).T)


def drawn_devices(balancer: LiquidRingBalancer, count: int) -> list[PackedDevice]:
    """First devices of `tune`'s verdicts on a scene, under the scene's own settings."""
    scene, runs = balancer.scene, balancer.drawn_runs
    numbers = range(FIRST_VERDICT_DEVICE, FIRST_VERDICT_DEVICE + count)
    pressures = [factor * scene.gas.pressure for factor in PRESSURE_FACTORS]
    fills = np.stack([runs.least_fills(numbers, each) for each in pressures], axis=-1)
    packed = []
    for at, device in enumerate(map(runs.device, numbers)):
        law = device.model.flow
        if not isinstance(law, CalibratedLaw):
            raise TypeError("devices of a panel have calibrated laws")
        settled = device.under(scene, of=scene)
        compact = compact_law(scene=settled, law=law, of_many=True)
        packed.append(PackedDevice.of(settled, law, compact, least_fills=fills[:, at]))
    return packed


def lost_times(scene: Scene, model: BalancerModel) -> list[float]:
    """Times, s, that a short injection loses to what the exported disc leaves out, at `PRESSURE_FACTORS`.

    By the mass of the liquid column and by its rise to the crest; the dead time of a run with all terms less
    that with gas and valve alone, at equal fills, for a correction at the controller's limit.
    """
    times = []
    for factor in PRESSURE_FACTORS:
        supplied = replace(scene, gas=replace(scene.gas, pressure=factor * scene.gas.pressure))
        rate, terms = loop_rate(supplied, model), run_terms(scene=supplied, model=model)
        dead = []
        for modelled in (terms, [each for each in terms if each in (FILLING, LAG)]):
            dynamics = dynamics_of(scene=supplied, model=model, modelled=modelled, checked=True)
            fill = scene.disc.initial_fill
            injections = Injections.of(dynamics, model, fill=fill, total=2 * fill)
            least = scene.controller.limit / rate * injections.steady if rate > 0.0 else None
            dead.append(0.0 if least is None else injections.dead_time(least) or 0.0)
        times.append(round(max(dead[0] - dead[1], 0.0), 6))
    return times


def packed_blocks(blocks: Iterable[Block]) -> tuple[str, list[list[int]]]:
    """Numbers of blocks as text, and of each the lengths of constants, cells, pieces, levels and row.

    Deflated and in base 64; of each table the bytes of one significance stand together, and column by column,
    so that they are alike.
    """
    data, lengths = b"", []
    for block in blocks:
        cells, pieces, levels = block.tables or ((), (), ())
        lengths.append([len(block.constants), len(cells), len(pieces), len(levels), len(block.start)])
        parts: Sequence[tuple[Any, npt.DTypeLike]] = (
            (block.constants, "<f8"),
            (cells, "u1"),
            (pieces, "<f4"),
            (levels, "<f8"),
            (block.start, "<f8"),
        )
        for numbers, kind in parts:
            table = np.ascontiguousarray(np.array(numbers, dtype=kind).T)
            data += table.reshape(-1).view(np.uint8).reshape(-1, table.itemsize).T.tobytes()
    return b64encode(zlib.compress(data, 9)).decode(), lengths
