"""Rules of shape for the disc and its tube.

Symbols: R1, R2 radii of the chamber, t plate thickness, theta central angle, r_p and r_m radii of port and
siphon crest, d bore, L length of the tube.
"""

from __future__ import annotations

import math

from ringbalance.scene.keys.derivations import even_number_of_chambers, shortest_path, swept_area
from ringbalance.scene.keys.reading import SceneReading
from ringbalance.scene.kinds import Check, Contradiction, check, written
from ringbalance.scene.models import Bend

_ROUNDING = 1e-9
_NARROWEST = 1 / 2000
"""Opening over depth of a chamber below which rounding costs a pressure field more than seven digits."""
_SHALLOWEST = 1e-8
"""Depth over outer radius of a full ring; calibration goes down to a fortieth of its fill."""
DRAWING_ROUNDING = 1e-5
"""Relative rounding of values in drawings: "1.5708 rad" is a right angle."""


def _radii_in_order(inner: float, outer: float) -> Contradiction | None:
    """R1 < R2."""
    if inner < outer:
        return None
    return Contradiction(
        problem=f"the inner radius must be smaller than outer_radius ({written(outer, 'mm')})",
        allowed=f"above 0 mm and below {written(outer, 'mm')}",
    )


def _chamber_has_depth(inner: float, outer: float) -> Contradiction | None:
    """R2 - R1 >= 1e-8 R2."""
    least = _SHALLOWEST * outer
    if outer - inner >= least:
        return None
    return Contradiction(
        problem=f"the chamber is too shallow to be resolved: outer_radius is {written(outer, 'mm')}",
        allowed=f"at least {_SHALLOWEST:g} of outer_radius, {written(least, 'mm')}, below outer_radius",
    )


def _fill_has_depth(share: float, inner: float, outer: float) -> Contradiction | None:
    """The ring at max_fill_ratio is at least 1e-8 R2 deep: R2 - sqrt(R2^2 - x (R2^2 - R1^2)).

    Geometry without plates, which at most halve the depth.
    """
    lowest = _SHALLOWEST * outer * (2 - _SHALLOWEST) * outer / ((outer - inner) * (outer + inner))
    if share >= lowest:
        return None
    # The allowed value is rounded up, so that the value in the message passes.
    return Contradiction(
        problem=f"the ring would be shallower than {_SHALLOWEST:g} of outer_radius "
        f"({written(outer, 'mm')}), too shallow to be resolved",
        allowed=f"at least {min(1.0, 1.01 * lowest):.3g} for this disc, at most 1",
    )


def _chamber_wide_enough(angle: float, thickness: float, inner: float, outer: float) -> Contradiction | None:
    """The opening between the plates is at least 1/2000 of the depth: 2 R1 (theta/2 - asin(t/R1)).

    Rounding in elongated cells grows with the square of depth over opening.
    """
    lowest = 2 * math.asin(thickness / inner) + _NARROWEST * (outer - inner) / inner
    if angle >= lowest:
        return None
    return Contradiction(
        problem=f"the chamber's opening at inner_radius ({written(inner, 'mm')}) is below 1/2000 of its "
        "depth, too narrow to be resolved",
        allowed=f"at least {written(1.001 * lowest, 'deg')} for these radii and this plate_thickness",
    )


def _plates_leave_room(thickness: float, inner: float, angle: float) -> Contradiction | None:
    """The plates leave an opening at the inner radius: asin(t/R1) < theta/2."""
    limit = inner * math.sin(min(angle, math.pi) / 2)
    if thickness < limit:
        return None
    return Contradiction(
        problem=f"the plates close the chamber at inner_radius ({written(inner, 'mm')})",
        allowed=f"at least 0 mm and below inner_radius * sin(central_angle / 2) = {written(limit, 'mm')}",
    )


def _chambers_fit(angle: float, chambers: int) -> Contradiction | None:
    """n theta <= 2 pi, within the rounding of a drawing."""
    limit = 2 * math.pi / chambers
    if angle <= limit * (1 + DRAWING_ROUNDING):
        return None
    return Contradiction(
        problem=f"{chambers} chambers of this angle do not fit into 360 deg",
        allowed=f"above 0 deg and at most 360 deg / chambers = {written(limit, 'deg')}",
    )


def _chambers_even(angle: float) -> Contradiction | None:
    """2 pi / theta is an even whole number."""
    if even_number_of_chambers(angle) is not None:
        return None
    return Contradiction(
        problem=f"360 deg / central_angle = {2 * math.pi / angle:.6g} is not an even number of chambers, at "
        "least four",
        allowed="90 deg, 60 deg, 45 deg, 36 deg ... (13.8462 deg for 26 chambers at the most), or at most "
        "90 deg with chambers given as well",
    )


def _fills_share_the_liquid(initial: float, share: float) -> Contradiction | None:
    """Two opposite chambers of equal fill share max_fill_ratio."""
    if abs(2 * initial - share) <= _ROUNDING * share:
        return None
    return Contradiction(
        problem=f"two opposite chambers start with equal fills that add up to max_fill_ratio ({share:g})",
        allowed=f"{share / 2:g}, or leave the key out",
    )


def _port_in_chamber(port: float, inner: float, outer: float) -> Contradiction | None:
    """R1 < r_p <= R2."""
    if inner < port <= outer:
        return None
    inside = f"above inner_radius ({written(inner, 'mm')})"
    return Contradiction(
        problem="the port lies outside the chamber",
        allowed=f"{inside} and at most outer_radius ({written(outer, 'mm')})",
    )


def _port_under_liquid(
    port: float, initial: float, inner: float, outer: float, angle: float, thickness: float
) -> Contradiction | None:
    """At the start the ports lie under the liquid: the fraction of the chamber outside r_p is below the fill.

    A port inside the outer wall is allowed: liquid outside it stays in its chamber.
    """
    outside = _fraction_outside(port, inner, outer, angle, thickness)
    if outside < initial:
        return None
    larger = f", or max_fill_ratio above {2 * outside:.3g}" if 2 * outside < 1 else ""
    return Contradiction(
        problem=f"at the start (fill {initial:.3g}) the liquid does not cover the port: {outside:.3g} of the "
        "chamber lies outside it, so gas would pass through the tube in place of liquid",
        allowed=f"nearer to outer_radius ({written(outer, 'mm')}){larger}",
    )


def _inlet_above_liquid(
    inlet: float, largest: float, inner: float, outer: float, angle: float, thickness: float
) -> Contradiction | None:
    """R1 <= r_i < R2, and the liquid of a pair in one chamber leaves the gas inlet free."""
    if not inner <= inlet < outer:
        inside = f"at least inner_radius ({written(inner, 'mm')})"
        return Contradiction(
            problem="the gas inlet lies outside the chamber",
            allowed=f"{inside} and below outer_radius ({written(outer, 'mm')})",
        )
    outside = _fraction_outside(inlet, inner, outer, angle, thickness)
    if largest < outside:
        return None
    return Contradiction(
        problem=f"at max_fill_ratio ({largest:.3g}) the liquid covers the gas inlet: {outside:.3g} of the "
        "chamber lies outside it",
        allowed=f"nearer to inner_radius ({written(inner, 'mm')}), or max_fill_ratio below {outside:.3g}",
    )


def _hole_fits_chamber(diameter: float, width: float, inner: float, outer: float) -> Contradiction | None:
    """The hole is no larger than the chamber."""
    limit = min(width, outer - inner)
    if diameter <= limit:
        return None
    return Contradiction(
        problem="the gas hole is larger than the chamber",
        allowed=f"above 0 mm and at most {written(limit, 'mm')}, the smaller of axial_width and "
        "outer_radius - inner_radius",
    )


def _hole_is_the_inlet(hole: float, inlet: float) -> Contradiction | None:
    """Gas enters through the hole."""
    if abs(hole - inlet) <= _ROUNDING * inlet:
        return None
    return Contradiction(
        problem=f"gas enters the chambers at gas.inlet_radius ({written(inlet, 'mm')})",
        allowed="that radius, or one of both keys alone",
    )


def _fraction_outside(radius: float, inner: float, outer: float, angle: float, thickness: float) -> float:
    """Fill ratio at which the free surface lies at a radius."""
    within = swept_area(
        radius=[inner, radius, outer], central_angle=angle, plate_thickness=thickness
    ).tolist()
    return float((within[2] - within[1]) / (within[2] - within[0]))


def _crest_in_disc(crest: float, outer: float) -> Contradiction | None:
    """r_m < R2, which holds for a crest inside any port."""
    if crest < outer:
        return None
    most = f"which is at most outer_radius ({written(outer, 'mm')})"
    return Contradiction(
        problem="the siphon crest lies outside the port, and outside the chamber's outer wall too",
        allowed=f"above 0 mm and below port_radius, {most}",
    )


def _crest_inside_port(crest: float, port: float) -> Contradiction | None:
    """r_m < r_p."""
    if crest < port:
        return None
    return Contradiction(
        problem="the siphon crest lies outside the port, but it is the smallest radius on the path",
        allowed=f"above 0 mm and below port_radius ({written(port, 'mm')}), or leave the key out",
    )


def _bore_fits_bends(bore: float, bends: tuple[Bend, ...]) -> Contradiction | None:
    """The inner side of each bend is curved: d/2 <= radius of the centre line."""
    tightest = min((bend.radius for bend in bends), default=math.inf)
    if bore <= 2 * tightest * (1 + _ROUNDING):
        return None
    return Contradiction(
        problem=f"the bore is wider than the tightest of the bends allows (radius {written(tightest, 'mm')})",
        allowed=f"above 0 mm and at most twice that radius, {written(2 * tightest, 'mm')}",
    )


def _bore_fits_chamber(bore: float, width: float, inner: float, outer: float) -> Contradiction | None:
    """Some wall of the chamber is as large as the bore."""
    limit = max(width, outer - inner)
    if bore <= limit:
        return None
    return Contradiction(
        problem="no wall of the chamber is large enough for this bore",
        allowed=f"above 0 mm and at most {written(limit, 'mm')}, the larger of axial_width and "
        "outer_radius - inner_radius",
    )


def _roughness_fits_bore(roughness: float, bore: float) -> Contradiction | None:
    """Roughness below d/2."""
    if roughness < bore / 2:
        return None
    return Contradiction(
        problem="a roughness of half the bore closes the tube",
        allowed=f"at least 0 um and below bore / 2 = {written(bore / 2, 'mm')}",
    )


def _length_holds_bends(length: float, bends: tuple[Bend, ...]) -> Contradiction | None:
    """L >= sum of the bends' arcs, each angle times radius."""
    arcs = math.fsum(bend.angle * bend.radius for bend in bends)
    if length >= arcs * (1 - _ROUNDING):
        return None
    return Contradiction(
        problem="the tube is shorter than the arcs of its bends together",
        allowed=f"at least {written(arcs, 'mm')}, the sum of angle * radius over the bends",
    )


def _length_reaches_over_crest(
    length: float, angle: float, port: float, crest: float
) -> Contradiction | None:
    """Check that the tube's length reaches over the crest."""
    return _length_reaches(length, angle, port, crest)


def _length_reaches(
    length: float, angle: float, port: float, crest: float | None = None
) -> Contradiction | None:
    """L >= the shortest path between ports anywhere in opposite chambers, at least pi - theta apart."""
    separation = max(math.pi - angle, 0.0)
    shortest = shortest_path(port_radius=port, hump_radius=crest, separation=separation)
    if length >= shortest * (1 - _ROUNDING):
        return None
    over = "" if crest is None else f" over the siphon crest at {written(crest, 'mm')}"
    return Contradiction(
        problem=f"the tube cannot reach the opposite port{over}",
        allowed=f"at least {written(shortest, 'mm')}, the shortest path from chamber to opposite chamber",
    )


def _entrance_has_radius(radius: float, entrance: str) -> Contradiction | None:
    """Only a rounded entrance has a radius."""
    if entrance == "rounded" or radius == 0:
        return None
    return Contradiction(
        problem=f'a {entrance} entrance has no radius (entrance = "{entrance}")',
        allowed='leave the key out, or entrance = "rounded"',
    )


_INNER, _OUTER, _ANGLE = "disc.inner_radius", "disc.outer_radius", "disc.central_angle"
_PLATE, _FILL = "disc.plate_thickness", "disc.max_fill_ratio"
_PORT, _CREST, _LENGTH, _BORE = "tube.port_radius", "tube.hump_radius", "tube.length", "tube.bore"
_HOLE_RADIUS = "disc.gas_hole_radius"
_NO_RING = (_radii_in_order,)
_NO_DEPTH = (_radii_in_order, _chamber_has_depth)
_CHAMBER = (_INNER, _OUTER, _ANGLE, _PLATE)
_NO_CHAMBER = (*_NO_DEPTH, _plates_leave_room, _chamber_wide_enough, _fill_has_depth, _fills_share_the_liquid)
_NO_PATH = (_port_in_chamber, _crest_in_disc, _crest_inside_port)


def _drawn(reading: SceneReading) -> bool:
    """True when keys describe the chamber; a mesh has separate checks."""
    return not reading.known("disc.geometry")


SIZE_CHECKS: tuple[Check, ...] = (
    check(_port_in_chamber, _PORT, _INNER, _OUTER, moot=_NO_RING),
    check(_crest_in_disc, _CREST, _OUTER),
    check(_crest_inside_port, _CREST, _PORT, moot=(_port_in_chamber, _crest_in_disc)),
    check(_bore_fits_chamber, _BORE, "disc.axial_width", _INNER, _OUTER, moot=_NO_RING),
    check(_length_reaches_over_crest, _LENGTH, _ANGLE, _PORT, _CREST, moot=_NO_PATH),
    check(_length_reaches, _LENGTH, _ANGLE, _PORT, moot=(_port_in_chamber, _length_reaches_over_crest)),
)
"""Checks of tube lengths that depend on the size of the chamber."""
CHECKS: tuple[Check, ...] = (
    check(_radii_in_order, _INNER, _OUTER),
    check(_chamber_has_depth, _INNER, _OUTER, moot=_NO_RING),
    check(_plates_leave_room, _PLATE, _INNER, _ANGLE),
    check(_chamber_wide_enough, _ANGLE, _PLATE, _INNER, _OUTER, moot=(*_NO_RING, _plates_leave_room)),
    check(_fill_has_depth, _FILL, _INNER, _OUTER, moot=_NO_DEPTH),
    check(_chambers_fit, _ANGLE, "disc.chambers"),
    check(_chambers_even, _ANGLE, when=lambda reading: not reading.given("disc.chambers")),
    check(_fills_share_the_liquid, "disc.initial_fill", _FILL),
    *SIZE_CHECKS,
    check(
        _port_under_liquid,
        _PORT,
        "disc.initial_fill",
        *_CHAMBER,
        moot=(*_NO_CHAMBER, _port_in_chamber),
        when=_drawn,
    ),
    check(_inlet_above_liquid, "gas.inlet_radius", _FILL, *_CHAMBER, moot=_NO_CHAMBER, when=_drawn),
    check(_hole_is_the_inlet, _HOLE_RADIUS, "gas.inlet_radius"),
    check(
        _inlet_above_liquid,
        _HOLE_RADIUS,
        _FILL,
        *_CHAMBER,
        moot=(*_NO_CHAMBER, _inlet_above_liquid, _hole_is_the_inlet),
        when=_drawn,
    ),
    check(_hole_fits_chamber, "disc.gas_hole_diameter", "disc.axial_width", _INNER, _OUTER, moot=_NO_RING),
    check(_bore_fits_bends, _BORE, "tube.bends"),
    check(_roughness_fits_bore, "tube.roughness", _BORE),
    check(_length_holds_bends, _LENGTH, "tube.bends"),
    check(_entrance_has_radius, "tube.entrance_radius", "tube.entrance"),
)
