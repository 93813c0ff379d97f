"""Gas pressures at which the tube's flow begins and ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ringbalance.reduced_model.law.calibrated_law import CalibratedLaw
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import HumpGas


def priming_pressure(
    *,
    law: CalibratedLaw,
    fill_ratio: npt.ArrayLike,
    opposite_fill_ratio: npt.ArrayLike | None = None,
    hump_gas: HumpGas,
) -> FloatArray | None:
    """Gas pressure that primes the tube: it lifts the liquid over the siphon crest.

    vented: rho omega^2 (a_A^2 - r_m^2)/2; trapped: that and rho omega^2 (r_p^2 - a_C^2)/2.
    Args: `law`: the flow law. `fill_ratio`: x of the driven chamber, any shape. `opposite_fill_ratio`: of the
        opposite chamber; default max_fill_ratio - fill_ratio. `hump_gas`: which of the two bounds, whatever
        the law itself uses.
    Returns: Gauge pressure, Pa, of the broadcast shape; None without a crest.
    Source: hydrostatics of the two legs in the rotating frame. For the liquid-ring paper's disc a crest at
        31.5 mm gives its 0.54 MPa, vented with the driven chamber nearly empty or trapped at equal fills: an
        inference, because the paper does not say what its figure means.
    """
    crest = law.path.crest
    if crest is None:
        return None
    ends = law.ends(fill_ratio=fill_ratio, opposite_fill_ratio=opposite_fill_ratio)
    return np.asarray(replace(crest, trapped=hump_gas == "trapped").priming_pressure(ends)) / law.gas_factor


def siphon_stall_pressure(law: CalibratedLaw) -> float:
    """Gauge pressure of the gas at which a full siphon from an empty chamber stands still, P_C - P_A, Pa.

    Source: Eq. 18 of the liquid-ring paper with u = 0 and finite-element wall pressures.
    """
    ends = law.ends(fill_ratio=0.0, opposite_fill_ratio=None)
    return float(ends.stall_pressure() / law.gas_factor)
