"""Grid convergence judged on sequences that were made from their limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from ringbalance.physics.convergence import GridConvergence, GridVerdict, gci
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, Level, Reference, Table, as_found

_LIMIT: Final = 1.0
_FORMAL: Final = 2.0
_FITTED: Final = 3.0


@dataclass(frozen=True, kw_only=True)
class _Sequence:
    """Values on meshes of size 1, 2, 4 ..., with what must be said of them."""

    name: str
    values: FloatArray
    expected: tuple[GridVerdict, ...]
    formal_order: float = _FORMAL
    converges: bool = True


def _h(levels: int = 3) -> FloatArray:
    return np.asarray(2.0 ** np.arange(levels), dtype=np.float64)


def _sequences() -> tuple[_Sequence, ...]:
    h = _h()
    noise = np.array([0.0, 1e-9, -1e-9, 1e-9, 0.0])
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
        _Sequence(
            name="five levels, third order, noise",
            values=_LIMIT + 1e-4 * _h(5) ** _FITTED + noise,
            expected=(GridVerdict.MONOTONE,),
            formal_order=_FITTED,
        ),
    )


reference = {"fitted_order": Reference(value=_FITTED)}


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
            fitted_order=judged["five levels, third order, noise"].observed_order,
        ),
        numbers={"sequences": float(len(sequences))},
        tables=(_table(judged),),
    )


def _judge(one: _Sequence, defect: str | None) -> GridConvergence:
    values = _by_magnitude(one.values) if defect == "signs_ignored" else one.values
    formal = 50.0 if defect == "cap_removed" else one.formal_order
    return gci(values=values.tolist(), sizes=_h(values.size).tolist(), formal_order=formal)


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
