"""A smooth line through noisy, interrupted and partly wrong values: a penalised B-spline.

Penalised splines as of Eilers and Marx (1996): equally spaced knots, more than needed, and a penalty on the second
differences of the coefficients. Where nothing is known the line goes on as smoothly as it can, straight at the ends.
The penalty is that of the least generalised cross-validation (Craven and Wahba, 1979) under the weights.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read
from dloftbs.kernels.shared.copying import copy_rows_to, copy_to
from dloftbs.kernels.shared.few import median
from dloftbs.kernels.shared.gaussian import MEAN_DEVIATION, MEDIAN_DEVIATION
from dloftbs.kernels.shared.selection import median_of
from dloftbs.lifting.kernels.columns import sort_columns

_ORDER = 4
"""Number of basis functions of a cubic that are not zero in a knot span.

Source: by definition.
"""

_PAD = _ORDER - 1
"""Number of rows of zeros after a band matrix.

Source: by definition; the order less one.
"""

_PENALTIES = 10.0 ** np.arange(-3.0, 7.0)
"""Factors of the roughness, as multiples of the mean weight of a coefficient, among which cross-validation chooses.

Source: numerics; from hardly any smoothing to straight, by factors of ten.
"""

_FIRST = 5
"""Index of the first of these factors.

Source: by hand; the middle of those that are chosen.
"""

_AROUND = 4
"""Number of known values to either side that show what is usual.

Source: by hand; up to four wrong ones in a row are given, and a slope is none.
"""

_MIN_REACH = 2
"""Least number of known values to either side whose median shows what is usual.

Source: by definition; a single wrong one of three is the median of none.
"""

_HUBER = 2.0
"""Limit of Huber's weights, as a multiple of the standard deviation.

Source: by hand; 99 % efficiency for Gaussian noise (Huber, Robust Statistics, 1981), since most outliers are gone.
"""

_CAUTION = 1.2
"""Factor of the number of parameters in cross-validation.

Source: by hand; neighbouring residuals of depth are alike, which plain cross-validation takes for a shape.
"""


@helper
def _factor(band: Floats) -> None:
    """Replace a matrix by its Cholesky factor, its diagonal inverted; band[i, k] is the entry at (i, i + k).

    All bands have `_PAD` rows of 0 more than the matrix, so that the loops over them have a fixed length.
    """
    n = len(band) - _PAD
    for i in range(n):
        scale = 1.0 / np.sqrt(band[i, 0])
        band[i, 0] = scale
        for k in range(1, _ORDER):
            band[i, k] *= scale
        for k in range(1, _ORDER):
            for j in range(k, _ORDER):
                band[i + k, j - k] -= band[i, k] * band[i, j]


@helper
def _solve(factor: Floats, right: Floats) -> None:
    """Solve by the factor, in place."""
    n = len(factor) - _PAD
    for i in range(n):
        right[i] *= factor[i, 0]
        for k in range(1, _ORDER):
            right[i + k] -= factor[i, k] * right[i]
    for i in range(n - 1, -1, -1):
        for k in range(1, _ORDER):
            right[i] -= factor[i, k] * right[i + k]
        right[i] *= factor[i, 0]


@helper
def _trace(factor: Floats, normal: Floats, inverse: Floats) -> float:
    """Return the trace of the inverse of a factored matrix times another one; only the bands are needed of both."""
    n = len(factor) - _PAD
    total = 0.0
    for i in range(n - 1, -1, -1):
        for j in range(min(_ORDER, n - i) - 1, 0, -1):
            value = 0.0
            for k in range(1, j):
                value -= factor[i, k] * inverse[i + k, j - k]
            for k in range(j, _ORDER):
                value -= factor[i, k] * inverse[i + j, k - j]
            inverse[i, j] = value * factor[i, 0]
            total += 2.0 * inverse[i, j] * normal[i, j]
        value = factor[i, 0]
        for k in range(1, _ORDER):
            value -= factor[i, k] * inverse[i, k]
        inverse[i, 0] = value * factor[i, 0]
        total += inverse[i, 0] * normal[i, 0]
    return total


@helper
def _gather(cells: Ints, basis: Floats, y: Floats, weight: Floats, normal: Floats, right: Floats) -> None:
    """Write the normal equations; the four rows that a cell adds to are held in registers, and move on with it."""
    n = len(y)
    aa = ab = ac = ad = bb = bc = bd = cc = cd = dd = 0.0
    ay = by = cy = dy = 0.0
    low = 0
    for i in range(n + 1):
        while low < len(right) and (i == n or low < cells[i]):
            normal[low, 0], normal[low, 1], normal[low, 2], normal[low, 3], right[low] = aa, ab, ac, ad, ay
            aa, ab, ac, ad, bb, bc, bd, cc, cd, dd = bb, bc, bd, 0.0, cc, cd, 0.0, dd, 0.0, 0.0
            ay, by, cy, dy = by, cy, dy, 0.0
            low += 1
        if i == n or not weight[i] > 0.0:
            continue
        a, b, c, d = basis[i, 0], basis[i, 1], basis[i, 2], basis[i, 3]
        wa, wb, wc, wd = weight[i] * a, weight[i] * b, weight[i] * c, weight[i] * d
        ay, by, cy, dy = ay + wa * y[i], by + wb * y[i], cy + wc * y[i], dy + wd * y[i]
        aa, ab, ac, ad = aa + wa * a, ab + wa * b, ac + wa * c, ad + wa * d
        bb, bc, bd = bb + wb * b, bc + wb * c, bd + wb * d
        cc, cd, dd = cc + wc * c, cd + wc * d, dd + wd * d


@helper
def _solve_at(penalty: float, normal: Floats, right: Floats, factor: Floats, coefficients: Floats) -> None:
    """Write the coefficients for a penalty, and the factor of their matrix."""
    m = len(normal) - _PAD
    copy_rows_to(factor, normal)
    for i in range(m - 2):
        factor[i, 0] += penalty
        factor[i, 1] -= 2.0 * penalty
        factor[i, 2] += penalty
        factor[i + 1, 0] += 4.0 * penalty
        factor[i + 1, 1] -= 2.0 * penalty
        factor[i + 2, 0] += penalty
    _factor(factor)
    copy_to(coefficients, right)
    _solve(factor, coefficients)


@helper
def _misfit(normal: Floats, right: Floats, squared: float, coefficients: Floats) -> float:
    """Return the weighted sum of the squared residuals, `squared` being that of the values themselves."""
    total = squared
    for i in range(len(normal) - _PAD):
        line = 0.5 * normal[i, 0] * coefficients[i]
        for k in range(1, _ORDER):
            line += normal[i, k] * coefficients[i + k]
        total += 2.0 * coefficients[i] * (line - right[i])
    return max(total, 0.0)


@helper
def _miss_neighbours(value: Floats, prior: Floats, root: Floats, misses: Floats) -> None:
    """Write by how much each known value differs from those around it.

    That is from the median of as many to either side, which on a slope is the value itself. At the ends, where there
    are none on one side, it is from the line through those beside it, by medians (Theil and Sen).
    """
    known = len(misses)
    own = np.empty(known, dtype=np.int64)
    k = 0
    for i in range(len(value)):
        if prior[i] > 0.0:
            own[k] = i
            k += 1
    around = min(2 * _AROUND + 1, known)
    apart = around // 2
    inner = np.empty((2 * _AROUND + 1, max(known - 2 * _AROUND, 0)))
    for j in range(2 * _AROUND + 1):
        for k in range(inner.shape[1]):
            inner[j, k] = value[own[j + k]]
    sort_columns(inner)
    levels, near, few = np.empty(around), np.empty(around), np.empty(around)
    for k in range(known):
        reach = min(_AROUND, k, known - 1 - k)
        if reach == _AROUND:
            usual = inner[_AROUND, k - _AROUND]
        elif reach >= _MIN_REACH:
            for j in range(2 * reach + 1):
                near[j] = value[own[k - reach + j]]
            usual = median(near[: 2 * reach + 1], few)
        else:
            low = 0 if k < known - 1 - k else known - around
            for j in range(around - apart):
                a, b = own[low + j], own[low + j + apart]
                levels[j] = (value[b] - value[a]) / (b - a)
            slope = median(levels[: around - apart], few)
            for j in range(around):
                levels[j] = value[own[low + j]] - slope * (own[low + j] - own[k])
            usual = median(levels, few)
        misses[k] = abs(value[own[k]] - usual) * root[own[k]]


@helper
def _weigh(prior: Floats, misses: Floats, scale: float, weight: Floats) -> None:
    """Write the weights of values by how far off they are, by Huber."""
    k = 0
    for i in range(len(prior)):
        if prior[i] > 0.0:
            weight[i] = prior[i] / max(misses[k] / (_HUBER * scale), 1.0) if scale > 0.0 else prior[i]
            k += 1


@kernel(read(float64, 1), read(float64, 1), int64, float64)
def smooth(y: Floats, counts: Floats, spans: int, floor: float) -> tuple[Floats, float]:
    """Lay a smooth line through equally spaced values, whatever stretches of them are missing or wrong.

    Values that differ from a line through those around by more than most do count less, wherever all of these lie: a
    steep slope is as good as any. The line itself strikes off nothing, since where it is too stiff for a bend, the bend
    would go.

    Not checked: two values or more are known.

    Parameters
    ----------
    y : (n,) float64
        NaN where it is not known.
    counts : (n,) float64
        Number of measurements that each is the mean of.
    spans : int
        Knot spans over all values.
    floor : float
        Least noise to expect, as a share of the mean value; 0 or more.

    Returns
    -------
    line : (n,) float64
    freedom : float
        Effective number of parameters of the line: 2 is straight.
    """
    n, m = len(y), spans + _ORDER - 1
    cells, basis = np.empty(n, dtype=np.int64), np.empty((n, _ORDER))
    value, prior = np.zeros(n), np.zeros(n)
    known, total, mean = 0, 0.0, 0.0
    for i in range(n):
        place = i * spans / max(n - 1, 1)
        cells[i] = min(int(place), spans - 1)
        t = place - cells[i]
        basis[i, 0] = (1.0 - t) ** 3 / 6.0
        basis[i, 1] = (3.0 * t**3 - 6.0 * t**2 + 4.0) / 6.0
        basis[i, 2] = (-3.0 * t**3 + 3.0 * t**2 + 3.0 * t + 1.0) / 6.0
        basis[i, 3] = t**3 / 6.0
        if not np.isnan(y[i]):
            prior[i] = counts[i]
            total += counts[i]
            mean += counts[i] * y[i]
            known += 1
    mean /= total
    usual = total / known
    root = np.zeros(n)
    for i in range(n):
        if prior[i] > 0.0:
            value[i] = y[i] - mean
            root[i] = np.sqrt(prior[i] / usual)
    rows = m + _PAD
    normal, factor, inverse = np.empty((rows, _ORDER)), np.empty((rows, _ORDER)), np.zeros((rows, _ORDER))
    right, coefficients, best = np.zeros(rows), np.zeros(rows), np.zeros(rows)
    weight, misses = np.zeros(n), np.empty(known)
    scores, tried = np.empty(len(_PENALTIES)), np.empty(len(_PENALTIES), dtype=np.bool_)
    _miss_neighbours(value, prior, root, misses)
    _weigh(prior, misses, max(median_of(misses) / MEDIAN_DEVIATION, floor * abs(mean)), weight)
    _gather(cells, basis, value, weight, normal, right)
    unit, squared, heaviest = 0.0, 0.0, 0.0
    for i in range(n):
        unit += weight[i]
        squared += weight[i] * value[i] * value[i]
        heaviest = max(heaviest, weight[i])
    tried[:] = False
    at, freedom = _FIRST, 0.0
    for step in (0, -1, 1):  # from the first penalty on, as long as it gets better
        p = at + step
        while 0 <= p < len(_PENALTIES) and not tried[p]:  # whatever a score is, each penalty is tried once
            tried[p] = True
            _solve_at(_PENALTIES[p] * unit / m, normal, right, factor, coefficients)
            trace = _trace(factor, normal, inverse)
            free = unit / heaviest - _CAUTION * trace
            scores[p] = _misfit(normal, right, squared, coefficients) / free**2 if free > 0.0 else np.inf
            if step != 0 and not scores[p] < scores[at]:
                break
            at, freedom = p, trace
            copy_to(best, coefficients)
            p += step
    line = np.full(n, mean)
    for i in range(n):
        for a in range(_ORDER):
            line[i] += basis[i, a] * best[cells[i] + a]
    return line, freedom


@kernel(read(float64, 1), read(float64, 1), read(boolean, 1), float64)
def deviation_of_line(y: Floats, line: Floats, seen: Bools, freedom: float) -> float:
    """Return the standard deviation of a smooth line by the noise of its values.

    That of n values of which each stands for itself is sqrt(freedom / n) times theirs. Neighbours that err alike are
    worth fewer values, by the sum of their autocorrelation up to the first lag at which it is not positive (Geyer,
    Practical Markov Chain Monte Carlo, 1992).

    Parameters
    ----------
    y, line : (n,) float64
        The values, which may be NaN where they are not seen, and the line through them.
    seen : (n,) bool
        Which of them count; at least one does.
    freedom : float
        As `smooth` returns it.
    """
    n = len(y)
    off = np.zeros(n)
    known, total, squares = 0, 0.0, 0.0
    for i in range(n):
        if seen[i]:
            off[i] = y[i] - line[i]
            known += 1
            total += abs(off[i])
            squares += off[i] * off[i]
    alike = 1.0
    for lag in range(1, n if squares > 0.0 else 1):
        pairs, product = 0, 0.0
        for i in range(n - lag):
            if seen[i] and seen[i + lag]:
                pairs += 1
                product += off[i] * off[i + lag]
        if not product > 0.0:
            break
        alike += 2.0 * (product / pairs) / (squares / known)
    return total / known / MEAN_DEVIATION * np.sqrt(alike * freedom / known)
