"""Values of cubic B-splines, by two recursions that round differently."""

from __future__ import annotations

from dloftbs.kernels.compiler import Floats, helper, inlined


@inlined
def _share(value: float, length: float) -> float:
    """Return a value over the length of an interval of knots; 0 for an interval of no length."""
    return value / length if length > 0.0 else 0.0


@helper
def basis_functions(knots: Floats, span: int, u: float) -> tuple[float, float, float, float]:
    """Return the four cubic basis functions of a knot span, by the recursion of Cox and de Boor.

    The order of its operations is scipy's, so that a sum of these times control points rounds as scipy's does.
    """
    a, b, c = knots[span - 2], knots[span - 1], knots[span]
    d, e, f = knots[span + 1], knots[span + 2], knots[span + 3]
    share = _share(1.0, d - c)
    first, second = share * (d - u), share * (u - c)
    share = _share(first, d - b)
    first, carry = share * (d - u), share * (u - b)
    share = _share(second, e - c)
    second, third = carry + share * (e - u), share * (u - c)
    share = _share(first, d - a)
    first, carry = share * (d - u), share * (u - a)
    share = _share(second, e - b)
    second, after = carry + share * (e - u), share * (u - b)
    share = _share(third, f - c)
    return first, second, after + share * (f - u), share * (u - c)


@helper
def point_and_slope(knots: Floats, control: Floats, span: int, u: float) -> tuple[float, float, float, float]:
    """Return ``(x, y)`` of a plane cubic at `u`, and a vector along its tangent, by de Boor's recursion.

    It blends the control points themselves. Not checked: ``knots[span] <= u <= knots[span + 1]``, the two different.
    """
    a, b, c = knots[span - 2], knots[span - 1], knots[span]
    d, e, f = knots[span + 1], knots[span + 2], knots[span + 3]
    early, middle, late = (u - a) / (d - a), (u - b) / (e - b), (u - c) / (f - c)
    before, after, last = (u - b) / (d - b), (u - c) / (e - c), (u - c) / (d - c)
    x, slope_x = _blend(control[span - 3 : span + 1, 0], early, middle, late, before, after, last)
    y, slope_y = _blend(control[span - 3 : span + 1, 1], early, middle, late, before, after, last)
    return x, y, slope_x, slope_y


@inlined
def _blend(
    control: Floats, early: float, middle: float, late: float, before: float, after: float, last: float
) -> tuple[float, float]:
    """Return one coordinate of the point, and of the last two points that it lies between, their difference."""
    p, q, r, s = control[0], control[1], control[2], control[3]
    p, q, r = p + early * (q - p), q + middle * (r - q), r + late * (s - r)
    p, q = p + before * (q - p), q + after * (r - q)
    return p + last * (q - p), q - p
