"""Depth of the liquid over a port that keeps the gas out of it."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene

_POINT_SINK_FACTOR: Final = 1.25 / (2 * math.pi**2) ** 0.2
"""0.6884; Lubin and Springer print 0.69."""
_MEAN_OF_LAYER: Final = 0.75
"""Reduction of ln(R/r) by the draining of the layer, 1/2, and by its mean in place of its edge, 1/4."""


def _draw_down_depth(
    *,
    flow_rate: npt.ArrayLike,
    acceleration: float,
    bore: float,
    kinematic_viscosity: float = 0.0,
    feed_radius: float = math.inf,
    below: float = 0.0,
) -> FloatArray:
    """Mean depth of a layer over a port at which gas enters it, m.

    Near the port h is the smaller of two depths, each of which suffices; they cross at u = 1.2 sqrt(g_c d),
    so that narrow ports follow the first and wide ones the second:

    - over a point sink, h = 0.6884 (Q^2/g_c)^(1/5): the least depth, at y^5 = Q^2/(2 pi^2 g_c), that
      satisfies Bernoulli's equation from the surface at rest to its axis, h = y + [Q/(2 pi y^2)]^2/(2 g_c);
    - over the rim as over a weir, h = (3/2) [Q/(pi d sqrt(g_c))]^(2/3), critical depth 2 h/3 along pi d: from
      a deeper layer more would fall into the port than the tube takes, and the port stays submerged.

    Around it the liquid comes as a viscous layer of depth y on the wall,
    Q(s) = 2 pi s (g_c/(3 nu)) y^3 dy/ds. With Q(s) = Q (1 - s^2/R^2), as the whole layer drains, from
    s = r = max(h, d/2) on
    y^4 = h^4 + (6 nu Q/(pi g_c)) [ln(s/r) - s^2/(2 R^2)], whose mean over the wall is
    H = (h^4 + (6 nu Q/(pi g_c)) [ln(R/r) - 3/4])^(1/4).
    Args: `flow_rate`: Q, m^3/s, any shape. `acceleration`: g_c towards the port, m/s^2. `bore`: d of the
        round port, m. `kinematic_viscosity`: nu, m^2/s. `feed_radius`: R, of the circle with the wall's
        area, m; needed with a viscosity. `below`: depth c of the liquid under the port, m, which makes the
        layer y + c deep.
    Raises: ValueError: an acceleration that is not positive and finite.
    Range: a port in the middle of its wall; a laminar layer, thin against R. A turbulent layer, possible with
        water, has more friction, whose part of the depth is still below a hundredth. The sink is inviscid and
        without swirl about the port's axis. A bathtub vortex draws gas from deeper; the rotation of a disc
        makes none, because its axis lies in the surface.
    Source: derived; the sink's power and factor are those of Lubin and Springer, "The formation of a dip on
        the surface of a liquid draining from a tank", J. Fluid Mech. 29 (1967) 385, who found it in
        experiments; the rim is the broad-crested weir, bent into a circle: the abstract of Proc. IMechE 198
        (1984), doi:10.1243/PIME_PROC_1984_198_016_02, states that the level over an outlet which lets gas in
        follows from the flow alone, and that such a model bounds the level over one that runs full; the layer
        is lubrication theory.
    """
    if not np.all((np.asarray(acceleration) > 0) & np.isfinite(acceleration)):
        raise ValueError("acceleration must be positive and finite: a disc at rest holds no liquid")
    rate = np.asarray(flow_rate, dtype=np.float64)
    sink = np.asarray(_POINT_SINK_FACTOR * (rate**2 / acceleration) ** 0.2)
    rim = np.asarray(1.5 * (rate / (math.pi * bore * np.sqrt(acceleration))) ** (2 / 3))
    h: FloatArray = np.asarray(np.minimum(sink, rim))
    if np.all(np.asarray(kinematic_viscosity) == 0):
        return h
    way = np.maximum(np.log(feed_radius / np.maximum(h, bore / 2)) - _MEAN_OF_LAYER, 0.0)
    feed = 6 * kinematic_viscosity * rate * way / (math.pi * acceleration)
    return np.asarray(((h + below) ** 4 + feed) ** 0.25 - below)


def port_depth(scene: Scene, *, flow_rate: npt.ArrayLike) -> FloatArray:
    """`_draw_down_depth` over the port of a scene's chamber, times `tube.draw_down_factor`, m.

    The port lies at r_p, where g_c = omega^2 r_p; the layer is fed from the outer wall.
    """
    disc, tube = scene.disc, scene.tube
    wall = disc.central_angle * disc.outer_radius * disc.axial_width
    return np.asarray(
        tube.draw_down_factor
        * _draw_down_depth(
            flow_rate=flow_rate,
            acceleration=scene.rotor.speed**2 * tube.port_radius,
            bore=tube.bore,
            kinematic_viscosity=scene.liquid.kinematic_viscosity,
            feed_radius=np.sqrt(wall / math.pi),
            below=np.maximum(disc.outer_radius - tube.port_radius, 0.0),
        )
    )
