"""Section of the region of interest: the part of the image that is read."""

from __future__ import annotations

from typing import TypeAlias

import msgspec

from dloftbs.config.section import Section
from dloftbs.errors import ConfigError
from dloftbs.support.values import MAX_PX, as_float, shown

Rectangle: TypeAlias = tuple[int, int, int, int]
Corner: TypeAlias = tuple[int, int]
Roi: TypeAlias = Rectangle | tuple[Corner, ...]
"""A rectangle ``(x, y, w, h)``, or the corners ``(x, y)`` of a polygon, px of the whole image."""

RoiLike: TypeAlias = object
"""Regions as users have them: the text of the command line, a sequence of numbers or of points, or an array of them."""

_MAX_CORNERS = 1000
"""Largest number of corners of a polygon; each edge is compared with each other one."""
_FORM = "(x, y, w, h), the corners [(x, y), (x, y), (x, y), ...] of a polygon, or text: 'X,Y,W,H' or 'X,Y:X,Y:X,Y'"


class RegionConfig(Section, frozen=True, kw_only=True):
    """Part of the image that is read: outside of it nothing is cable, and its edge acts as the image's border.

    Parameters
    ----------
    roi : tuple, str or None
        Region of interest, px of the whole image: a rectangle ``[x, y, w, h]`` of whole pixels, or the corners ``[[x,
        y], [x, y], [x, y]]`` of a polygon, which are rounded to whole pixels and belong to it; as text
        ``"100,50,640,480"`` or ``"100,50:740,50:420,530"``. It must lie within the image. None reads all of it.

    Examples
    --------
    >>> RegionConfig(roi="100,50,640,480").roi
    (100, 50, 640, 480)
    >>> RegionConfig(roi=[(0, 0), (99.6, 0), (50, 80)]).roi
    ((0, 0), (100, 0), (50, 80))
    """

    roi: str | tuple[float | tuple[float, float], ...] | None = None

    def __post_init__(self) -> None:
        if self.roi is not None:
            msgspec.structs.force_setattr(self, "roi", read_roi(self.roi))


def read_roi(given: RoiLike) -> Roi:
    """Return a region of interest as a rectangle or a polygon of whole pixels.

    Raises
    ------
    ConfigError
        If it has another form, a number is not finite or out of range, a rectangle is empty, or a polygon has fewer
        than three corners, no area, or edges that meet.
    """
    values = _numbers_in(given) if isinstance(given, str) else _listed(given, given)
    if len(values) == 4 and not any(isinstance(value, (list, tuple)) for value in values):
        return _rectangle(values, given)
    corners = [_corner(_listed(value, given), given) for value in values]
    return _polygon(corners, given)


def _rectangle(values: list[object], given: object) -> Rectangle:
    sides = [_number(value, given) for value in values]
    if any(side != int(side) for side in sides):
        raise ConfigError(f"roi must have whole pixels x, y, w and h, got {shown(given)}")
    x, y, w, h = (int(side) for side in sides)
    if w <= 0 or h <= 0:
        raise ConfigError(f"roi must have a width and a height of at least 1 px, got w = {w} and h = {h}")
    return x, y, w, h


def _corner(values: list[object], given: object) -> Corner:
    if len(values) != 2:
        raise ConfigError(f"roi must be {_FORM}; got {shown(given)}")
    x, y = (round(_number(value, given)) for value in values)
    return x, y


def _polygon(corners: list[Corner], given: object) -> tuple[Corner, ...]:
    kept = [corner for place, corner in enumerate(corners) if corner != corners[place - 1]]
    if len(kept) < 3:
        raise ConfigError(f"roi must have three different corners or more as a polygon, got {shown(given)}")
    if len(kept) > _MAX_CORNERS:
        raise ConfigError(f"roi must have {_MAX_CORNERS} corners at most, got {len(kept)}")
    edges = list(zip(kept, kept[1:] + kept[:1], strict=True))
    for place, one in enumerate(edges):
        for other in edges[place + 1 :]:
            if _cross(*one, *other):
                (ax, ay), (bx, by) = one
                (cx, cy), (dx, dy) = other
                raise ConfigError(
                    "roi must be a polygon whose edges meet at its corners alone; "
                    f"those from ({ax}, {ay}) to ({bx}, {by}) and from ({cx}, {cy}) to ({dx}, {dy}) cross or overlap: "
                    "list the corners in their order around it"
                )
    return tuple(kept)


def _cross(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Return True if two edges share a point, other than the corner between two that follow each other."""
    shared = {a, b} & {c, d}
    if len(shared) == 1:  # they meet there anyway, and more than there if one leads back along the other
        (corner,) = shared
        (p,), (q,) = {a, b} - shared, {c, d} - shared
        ahead = (p[0] - corner[0]) * (q[0] - corner[0]) + (p[1] - corner[1]) * (q[1] - corner[1])
        follows = corner in (b, a) and (b == c or a == d)
        return not follows or (_side(corner, p, q) == 0 and ahead > 0)
    sides = _side(a, b, c), _side(a, b, d), _side(c, d, a), _side(c, d, b)
    if sides == (0, 0, 0, 0):
        return all(max(p, r) <= min(q, s) for p, q, r, s in _extents(a, b, c, d))
    return sides[0] * sides[1] <= 0 and sides[2] * sides[3] <= 0


def _extents(a: Corner, b: Corner, c: Corner, d: Corner) -> list[tuple[int, int, int, int]]:
    """Return for x and y from where to where each of two edges reaches."""
    return [(min(p, q), max(p, q), min(r, s), max(r, s)) for p, q, r, s in zip(a, b, c, d, strict=True)]


def _side(a: Corner, b: Corner, point: Corner) -> int:
    """Return 1 or -1 for the side of the line from a to b that a point lies on, 0 on the line."""
    turn = (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])
    return (turn > 0) - (turn < 0)


def _numbers_in(text: str) -> list[object]:
    """Read ``X,Y,W,H`` or ``X,Y:X,Y:X,Y`` as lists of numbers."""
    try:
        parts: list[object] = [[float(number) for number in part.split(",")] for part in text.split(":")]
    except ValueError:
        raise ConfigError(f"roi must be {_FORM}; got {shown(text)}") from None
    return _listed(parts[0], text) if len(parts) == 1 else parts


def _listed(value: object, given: object) -> list[object]:
    """Return the items of a list, a tuple or an array, which is a part of what was given."""
    listed = value.tolist() if callable(getattr(value, "tolist", None)) else value  # type: ignore[attr-defined]  # asked for
    if not isinstance(listed, (list, tuple)):
        raise ConfigError(f"roi must be {_FORM}; got {shown(given)}")
    return list(listed)


def _number(value: object, given: object) -> float:
    number = as_float(value)
    if number is None or abs(number) > MAX_PX:
        raise ConfigError(f"roi must consist of finite numbers of pixels, {MAX_PX} at most, got {shown(given)}")
    return number
