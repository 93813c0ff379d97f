"""Rules of shape for the disc and its tube: each takes SI values and says what is wrong, or None."""

from __future__ import annotations

import math

from ringbalance.scene.keys.derivations import even_number_of_chambers
from ringbalance.scene.models import Bend
from ringbalance.scene.path import shortest_path
from ringbalance.scene.rules.finding import Finding, deg, mm

_ROUNDING = 1e-9
_NARROWEST = 1 / 2000
"""Opening over depth of a chamber below which rounding costs a pressure field more than seven digits."""
_SHALLOWEST = 1e-8
"""Depth over outer radius of a full ring; calibration goes down to a fortieth of its fill."""
_DRAWING_ROUNDING = 1e-5
"""Relative: "1.5708 rad" is a right angle."""


def radii_in_order(inner: float, outer: float) -> Finding | None:
    """R1 < R2.

    Args: `inner`: R1, m. `outer`: R2, m.
    Returns: None when it holds.
    """
    if inner < outer:
        return None
    return Finding(
        problem=f"the inner radius must be smaller than outer_radius ({mm(outer)})",
        allowed=f"above 0 mm and below {mm(outer)}",
    )


def chamber_has_depth(inner: float, outer: float) -> Finding | None:
    """R2 - R1 >= 1e-8 R2.

    Args: `inner`: R1, m. `outer`: R2, m.
    Returns: None when it holds.
    """
    if outer - inner >= _SHALLOWEST * outer:
        return None
    return Finding(
        problem=f"the chamber is too shallow to be resolved: outer_radius is {mm(outer)}",
        allowed=f"at least {_SHALLOWEST:g} of outer_radius, {mm(_SHALLOWEST * outer)}, below outer_radius",
    )


def fill_has_depth(share: float, inner: float, outer: float) -> Finding | None:
    """The ring at max_fill_ratio is at least 1e-8 R2 deep: R2 - sqrt(R2^2 - x (R2^2 - R1^2)).

    Args: `inner`: R1, m. `outer`: R2, m.
    Returns: None when it holds.
    Source: geometry without plates, which at most halve the depth.
    """
    lowest = _SHALLOWEST * outer * (2 - _SHALLOWEST) * outer / ((outer - inner) * (outer + inner))
    if share >= lowest:
        return None
    # The allowed value is rounded up, so that what the message names passes.
    return Finding(
        problem=f"the ring would be shallower than {_SHALLOWEST:g} of outer_radius ({mm(outer)}), "
        "too shallow to be resolved",
        allowed=f"at least {min(1.0, 1.01 * lowest):.3g} for this disc, at most 1",
    )


def chamber_wide_enough(angle: float, thickness: float, inner: float, outer: float) -> Finding | None:
    """The opening between the plates is at least 1/2000 of the depth: 2 R1 (theta/2 - asin(t/R1)).

    Args: `angle`: theta, rad. `thickness`: t, m. `inner`: R1, m. `outer`: R2, m.
    Returns: None when it holds.
    Source: rounding in elongated cells grows with the square of depth over opening.
    """
    lowest = 2 * math.asin(thickness / inner) + _NARROWEST * (outer - inner) / inner
    if angle >= lowest:
        return None
    return Finding(
        problem=f"the chamber's opening at inner_radius ({mm(inner)}) is below 1/2000 of its depth, "
        "too narrow to be resolved",
        allowed=f"at least {deg(1.001 * lowest)} for these radii and this plate_thickness",
    )


def plates_leave_room(thickness: float, inner: float, angle: float) -> Finding | None:
    """The plates leave an opening at the inner radius: asin(t/R1) < theta/2.

    Args: `thickness`: t, m. `inner`: R1, m. `angle`: theta, rad.
    Returns: None when it holds.
    """
    limit = inner * math.sin(min(angle, math.pi) / 2)
    if thickness < limit:
        return None
    return Finding(
        problem=f"the plates close the chamber at inner_radius ({mm(inner)})",
        allowed=f"at least 0 mm and below inner_radius * sin(central_angle / 2) = {mm(limit)}",
    )


def chambers_fit(angle: float, chambers: int) -> Finding | None:
    """n theta <= 2 pi, within the rounding of a drawing.

    Args: `angle`: theta, rad.
    Returns: None when it holds.
    """
    limit = 2 * math.pi / chambers
    if angle <= limit * (1 + _DRAWING_ROUNDING):
        return None
    return Finding(
        problem=f"{chambers} chambers of this angle do not fit into 360 deg",
        allowed=f"above 0 deg and at most 360 deg / chambers = {deg(limit)}",
    )


def chambers_even(angle: float) -> Finding | None:
    """2 pi / theta is an even whole number.

    Args: `angle`: theta, rad.
    Returns: None when it holds.
    """
    if even_number_of_chambers(angle) is not None:
        return None
    number = 2 * math.pi / angle
    return Finding(
        problem=f"360 deg / central_angle = {number:.6g} is not an even number of chambers",
        allowed="180 deg, 90 deg, 60 deg, 45 deg, 36 deg ... (13.8462 deg for 26 chambers at the most), "
        "or chambers given as well",
    )


def fills_share_the_liquid(initial: float, share: float) -> Finding | None:
    """Two opposite chambers of equal fill share max_fill_ratio.

    Args: `initial`: fill ratio at the start.
    Returns: None when it holds.
    """
    if abs(2 * initial - share) <= _ROUNDING * share:
        return None
    return Finding(
        problem=f"two opposite chambers start with equal fills that add up to max_fill_ratio ({share:g})",
        allowed=f"{share / 2:g}, or leave the key out",
    )


def port_in_chamber(port: float, inner: float, outer: float) -> Finding | None:
    """R1 < r_p <= R2.

    Args: `port`: r_p, m. `inner`: R1, m. `outer`: R2, m.
    Returns: None when it holds.
    """
    if inner < port <= outer:
        return None
    return Finding(
        problem="the port lies outside the chamber",
        allowed=f"above inner_radius ({mm(inner)}) and at most outer_radius ({mm(outer)})",
    )


def hump_in_disc(hump: float, outer: float) -> Finding | None:
    """r_m < R2, which holds for a crest inside any port. Returns: None when it holds."""
    if hump < outer:
        return None
    return Finding(
        problem="the siphon crest lies outside the port, and outside the chamber's outer wall too",
        allowed=f"above 0 mm and below port_radius, which is at most outer_radius ({mm(outer)})",
    )


def hump_inside_port(hump: float, port: float) -> Finding | None:
    """r_m < r_p. Returns: None when it holds."""
    if hump < port:
        return None
    return Finding(
        problem="the siphon crest lies outside the port, but it is the smallest radius on the path",
        allowed=f"above 0 mm and below port_radius ({mm(port)}), or leave the key out",
    )


def bore_fits_bends(bore: float, bends: tuple[Bend, ...]) -> Finding | None:
    """The inner side of each bend has a radius of its own: d/2 <= radius of the centre line.

    Args: `bore`: d, m.
    Returns: None when it holds.
    """
    tightest = min((bend.radius for bend in bends), default=math.inf)
    if bore <= 2 * tightest * (1 + _ROUNDING):
        return None
    return Finding(
        problem=f"the bore is wider than the tightest of the bends allows (radius {mm(tightest)})",
        allowed=f"above 0 mm and at most twice that radius, {mm(2 * tightest)}",
    )


def bore_fits_chamber(bore: float, width: float, inner: float, outer: float) -> Finding | None:
    """Some wall of the chamber is as large as the bore.

    Args: `bore`: d, m. `width`: B, m. `inner`: R1, m. `outer`: R2, m.
    Returns: None when it holds.
    """
    limit = max(width, outer - inner)
    if bore <= limit:
        return None
    return Finding(
        problem="no wall of the chamber is large enough for this bore",
        allowed=f"above 0 mm and at most {mm(limit)}, the larger of axial_width and "
        "outer_radius - inner_radius",
    )


def roughness_fits_bore(roughness: float, bore: float) -> Finding | None:
    """Roughness below d/2.

    Args: `roughness`: m. `bore`: d, m.
    Returns: None when it holds.
    """
    if roughness < bore / 2:
        return None
    return Finding(
        problem="a roughness of half the bore closes the tube",
        allowed=f"at least 0 um and below bore / 2 = {mm(bore / 2)}",
    )


def length_holds_bends(length: float, bends: tuple[Bend, ...]) -> Finding | None:
    """L >= sum of the bends' arcs, each angle times radius.

    Args: `length`: L, m.
    Returns: None when it holds.
    """
    arcs = math.fsum(bend.angle * bend.radius for bend in bends)
    if length >= arcs * (1 - _ROUNDING):
        return None
    return Finding(
        problem="the tube is shorter than the arcs of its bends together",
        allowed=f"at least {mm(arcs)}, the sum of angle * radius over the bends",
    )


def length_reaches_over_hump(length: float, angle: float, port: float, hump: float) -> Finding | None:
    """L >= the shortest path over the crest between ports anywhere in opposite chambers.

    Args: `length`: L, m. `angle`: theta, rad. `port`: r_p, m. `hump`: r_m, m.
    Returns: None when it holds.
    """
    return length_reaches(length, angle, port, hump)


def length_reaches(length: float, angle: float, port: float, hump: float | None = None) -> Finding | None:
    """L >= the shortest path between ports anywhere in opposite chambers.

    Args: `length`: L, m. `angle`: theta, rad. `port`: r_p, m. `hump`: r_m, m; None for a path that may go
        anywhere.
    Returns: None when it holds.
    """
    # Ports anywhere in opposite chambers are at least pi - theta apart.
    separation = max(math.pi - angle, 0.0)
    shortest = shortest_path(port_radius=port, hump_radius=hump, separation=separation)
    if length >= shortest * (1 - _ROUNDING):
        return None
    over = "" if hump is None else f" over the siphon crest at {mm(hump)}"
    return Finding(
        problem=f"the tube cannot reach the opposite port{over}",
        allowed=f"at least {mm(shortest)}, the shortest path from chamber to opposite chamber",
    )


def entrance_has_radius(radius: float, entrance: str) -> Finding | None:
    """Only a rounded entrance has a radius.

    Args: `radius`: m. `entrance`: its kind.
    Returns: None when it holds.
    """
    if entrance == "rounded" or radius == 0:
        return None
    return Finding(
        problem=f'a {entrance} entrance has no radius (entrance = "{entrance}")',
        allowed='leave the key out, or entrance = "rounded"',
    )
