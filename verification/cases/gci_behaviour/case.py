"""Grid convergence judged on sequences that were made from their limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.physics.convergence import GridConvergence, GridVerdict, gci
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Table, as_found

_LIMIT: Final = 1.0
_FORMAL: Final = 2.0
_SIZES: Final = np.array([1.0, 2.0, 4.0])


@dataclass(frozen=True, kw_only=True)
class _Sequence:
    """Values on meshes of size 1, 2 and 4, with what must be said of them."""

    name: str
    values: FloatArray
    expected: tuple[GridVerdict, ...]
    converges: bool = True


def _sequences() -> tuple[_Sequence, ...]:
    h = _SIZES
    astray = (GridVerdict.NOT_ASYMPTOTIC, GridVerdict.DIVERGING)
    return (
        _Sequence(name="second order", values=_LIMIT + 1e-3 * h**2, expected=(GridVerdict.MONOTONE,)),
        _Sequence(
            name="with a fourth-order part",
            values=_LIMIT + 1e-3 * h**2 + 1e-5 * h**4,
            expected=(GridVerdict.MONOTONE,),
        ),
        _Sequence(
            name="faster than formal", values=_LIMIT + 1e-4 * h**4, expected=(GridVerdict.NOT_ASYMPTOTIC,)
        ),
        _Sequence(
            name="oscillatory",
            values=_LIMIT + 1e-3 * h**2 * np.array([1.0, -1.0, 1.0]),
            expected=(GridVerdict.OSCILLATORY,),
        ),
        _Sequence(name="slow", values=_LIMIT + 1e-3 * h**0.6, expected=astray),
        _Sequence(
            name="growing", values=_LIMIT + 1e-3 * h**-1.0, expected=(GridVerdict.DIVERGING,), converges=False
        ),
        _Sequence(
            name="round-off",
            values=_LIMIT + np.array([0.0, 4e-16, -4e-16]),
            expected=(GridVerdict.ROUND_OFF,),
        ),
    )


def compute(scene: Scene, level: Level, defect: str | None = None) -> Evidence:
    sequences = _sequences()
    judged = {one.name: _judge(one, defect) for one in sequences}
    wrong = sum(judged[one.name].verdict not in one.expected for one in sequences)
    errors = {one.name: abs(float(one.values[0]) - _LIMIT) for one in sequences if one.converges}
    missed = sum(error > judged[name].uncertainty for name, error in errors.items())
    return Evidence(
        found=as_found(
            wrong_verdicts=wrong,
            capped_order=judged["faster than formal"].order,
            missed_limits=missed,
        ),
        numbers={"sequences": float(len(sequences))},
        tables=(_table(judged),),
    )


def _judge(one: _Sequence, defect: str | None) -> GridConvergence:
    values = _by_magnitude(one.values) if defect == "signs_ignored" else one.values
    formal = 50.0 if defect == "cap_removed" else _FORMAL
    return gci(values=values.tolist(), sizes=_SIZES.tolist(), formal_order=formal)


def _by_magnitude(values: FloatArray) -> FloatArray:
    return np.concatenate([values[:1], values[0] + np.cumsum(np.abs(np.diff(values)))])


def _table(judged: Mapping[str, GridConvergence]) -> Table:
    return Table(
        name="made-up sequences, all with the limit 1",
        columns={
            "sequence": list(judged),
            "verdict": [result.verdict.value for result in judged.values()],
            "observed order": [result.observed_order for result in judged.values()],
            "order used": [result.order for result in judged.values()],
            "half-width": [result.uncertainty for result in judged.values()],
        },
    )
