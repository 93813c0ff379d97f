"""The compact law as a table of values, for programs that interpolate, with the interpolation error."""

from __future__ import annotations

from itertools import product
from typing import Final

import numpy as np

from ringbalance.export.blocks import tabulation
from ringbalance.export.compact import CompactLaw
from ringbalance.export.hosts import plain_name

COLUMNS: Final = (
    "fill_ratio",
    "gas_pressure_Pa",
    "primed",
    "velocity_m_per_s",
    "uncertainty_m_per_s",
    "regime",
    "status",
    "primed_afterwards",
)


def csv_files(law: CompactLaw, name: str, *, points: int, highest: float) -> dict[str, str]:
    """A grid of fills and pressures; the opposite chamber holds the rest of the pair's liquid.

    Args: `points`: number on each axis. `highest`: gauge pressure of the gas at the end of the grid, Pa.
    """
    fills, pressures = np.linspace(0.0, law.max_fill_ratio, points), np.linspace(0.0, highest, points)
    answers = {
        key: law.answer(fill_ratio=key[0], gas_pressure=key[1], primed=key[2])
        for key in product(fills.tolist(), pressures.tolist(), (False, True))
    }

    # Errors of interpolation in the middle of cells of one regime, m/s, and number of cells with several.
    errors, mixed = [], 0
    cells = list(product(range(points - 1), range(points - 1), (False, True)))
    for i, j, primed in cells:
        corners = [
            answers[float(fills[i + a]), float(pressures[j + b]), primed] for a, b in product((0, 1), (0, 1))
        ]
        middle = law.answer(
            fill_ratio=float(fills[i : i + 2].mean()),
            gas_pressure=float(pressures[j : j + 2].mean()),
            primed=primed,
        )
        if {each.regime for each in corners} == {middle.regime}:
            errors.append(abs(middle.velocity - sum(each.velocity for each in corners) / 4))
        else:
            mixed += 1
    largest = float(np.max(errors)) if errors else 0.0
    most = float(np.quantile(errors, 0.95)) if errors else 0.0

    head = (
        f"Flow law of a liquid-ring balancer, made by ringbalance from {plain_name(law.scene)}.",
        *tabulation(law).splitlines(),
        "units: fill ratios in 1, gauge pressures in Pa, velocities in m/s; uncertainty expanded (95 %)",
        "regime: 0 blocked, 1 siphon, 2 separated, 3 reverse",
        "status: 0 ok, 1 extrapolated, 2 blocked, 4 invalid",
        f"opposite fill ratio: {law.max_fill_ratio!r} less the fill ratio",
        "error of bilinear interpolation in the middle of cells whose corners have one regime: at most "
        f"{largest:.2g} m/s, 95 % below {most:.2g} m/s",
        f"cells with more than one regime, of no use for interpolation: {100 * (mixed / len(cells)):.1f} %",
    )
    lines = [*(f"# {line.strip()}" for line in head), ",".join(COLUMNS)]
    x, p, wet = (np.array(column) for column in zip(*answers, strict=True))
    flow = law.calibrated.evaluate(fill_ratio=x, gas_pressure=p, primed=wet)
    for (key, answer), width in zip(answers.items(), flow.uncertainty.tolist(), strict=True):
        fill, pressure, primed = key
        values = (answer.velocity, width, answer.regime, answer.status, int(answer.primed))
        lines.append(f"{fill!r},{pressure!r},{int(primed)}," + ",".join(map(repr, values)))
    return {f"{name}.csv": "\n".join(lines) + "\n"}
