"""Both readings of the liquid-ring paper's Fig. 7, which fixes only the product kappa lambda rho S u.

The paper gives no bore.  One follows from k = 50, another one from the calibrated law; each bundled scene has
the paper's rate under the law that its bore came from.
"""

from __future__ import annotations

from functools import lru_cache

from ringbalance.scene import bundled_scene, liquid_ring_scene, load_scene
from ringbalance.scene.models import Scene


@lru_cache(maxsize=1)
def readings() -> tuple[Scene, Scene]:
    """The paper's disc with its bore from k = 50, and from the calibrated law."""
    k_50, calibrated = (
        liquid_ring_scene(load_scene(bundled_scene(name)))
        for name in ("liquid_ring_paper", "liquid_ring_paper_calibrated")
    )
    return k_50, calibrated
