"""Bends of a curve without the waves that only its noise has: where it bends most, and by which radius.

A fitted curve follows the pixels' noise as closely as its knots let it, and the second derivative is most of all that
noise. So the curvature is averaged over windows along the curve. Each place has the longest window that the noise alone
explains: its average and those over all shorter windows lie within a few deviations of each other (O. V. Lepski, 1991).
Windows become as long as a bend of one radius, and stay short where the curvature changes.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.ndimage import convolve1d

from dloftbs.data.curve_like import CurveLike
from dloftbs.data.spline_geometry import bends, directions
from dloftbs.support.arrays import LARGEST, FloatArray
from dloftbs.support.values import check_number

_KNOTS_PER_WAVE = 1.0
"""Length of the waves that are noise where nothing else is stated, distances between knots.

Source: measured by benchmarks.bends on other seeds; with 0.7, noise makes bends 5 to 10 % too tight, with 2, waves are
flattened.
"""

WIDTHS_PER_WAVE = 2.0
"""Least length of the waves of an object of known width that are no noise, widths.

Source: measured by benchmarks.bends on other seeds than its own: with 4, waves are flattened.
"""

_PLACE_WAVES = 7.0
"""Length of the window in which the place of a bend is looked for, shortest waves.

Source: measured as above; from 6 to 7.5 the radii are alike. In short windows, the place of the largest of many noisy
values is that of the largest error.
"""

_DEVIATIONS = 1.5
"""Number of deviations within which the averages over two windows are equal.

Source: measured as above; from 1 to 3 the radii are alike, and waves are flattened the more the larger it is.
"""

_GROWTH = 1.2
"""Ratio of the lengths of two windows that follow each other.

Source: numerics.
"""

_STEPS = 12
"""Number of points in the shortest window.

Source: numerics; more change radii by less than 0.01 of them.
"""

_LONGEST = 9.0
"""Length of the longest window, shortest waves.

Source: bounds time; longer ones change the radii of benchmarks.bends by less than 0.01 of them.
"""

_LENGTHS = _GROWTH ** np.arange(1.0 + np.floor(np.log(_LONGEST) / np.log(_GROWTH)))
"""Lengths of all windows, shortest waves.

Source: by definition.
"""

_MOST = 20_000
"""Largest number of points.

Source: bounds time, where the shortest wave is a tiny part of the curve.
"""

_TINY = float(np.finfo(np.float64).tiny)
"""Least divisor.

Source: numerics.
"""

_LEAST_DIRECTION = 0.5
"""Least length of the average of the unit tangents in a window: a curve that turns farther is averaged no longer.

Source: by definition; a window six radii long on a circle.
"""

_CHI_SQUARE_MEDIANS = {1: 0.4549, 2: 1.3863}
"""Median of a sum of squares of independent normal errors, by their number.

Source: by definition.
"""


def bend_radius(curve: CurveLike, u: npt.ArrayLike, over: float | None) -> FloatArray:
    """Return the radii at `u` (...) of a curve without waves that are shorter than `over`."""
    t = curve.t_at(u)  # whether it is on the curve
    wave = _shortest_wave(curve, over)
    if not wave:
        return _radius(curve.curvature(u))
    places, curvature, _ = _smooth_curvature(curve, wave)
    return _radius(np.interp(curve.u_at(t), places, curvature, period=1.0 if curve.closed else None))


def tightest_bend(curve: CurveLike, over: float | None) -> tuple[float, float]:
    """Return the place where a curve without short waves bends most, and the radius there."""
    wave = _shortest_wave(curve, over)
    if wave:
        places, curvature, best = _smooth_curvature(curve, wave)
        return float(places[best]), float(_radius(curvature)[best])
    breaks = curve.breaks
    t = np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * (np.arange(_STEPS) / _STEPS)).ravel(), 1.0)
    u = curve.u_at(t)
    most = int(np.argmax(curve.curvature(u)))
    nearby = np.linspace(u[max(most - 1, 0)], u[min(most + 1, len(u) - 1)], 2 * _STEPS + 1)
    near = curve.curvature(nearby)
    best = int(near.argmax())
    return float(nearby[best]), float(_radius(near)[best])


def wave_of_knots(curve: CurveLike) -> float:
    """Return the length of the shortest waves that the knots of a curve carry, in its unit."""
    return _KNOTS_PER_WAVE * curve.length / (len(curve.breaks) - 1)


def _shortest_wave(curve: CurveLike, over: float | None) -> float:
    """Return the length of the shortest waves that are bends, at most that of the curve; 0 to take it as it is."""
    wave = wave_of_knots(curve) if over is None else check_number("over", over, 0.0, LARGEST)
    return min(wave, curve.length)


def _smooth_curvature(curve: CurveLike, wave: float) -> tuple[FloatArray, FloatArray, int]:
    """Return places (n,) along a curve, the curvature there (n,), and the number of the place that bends most."""
    count = min(int(np.ceil(_STEPS * curve.length / wave)), _MOST)
    places = np.linspace(0.0, 1.0, count + 1)[: count if curve.closed else None]
    t = curve.t_at(places)
    course = np.concatenate((directions(curve.spline, t), bends(curve.spline, t)), axis=1)
    windows = wave * count / curve.length * _LENGTHS
    windows = windows[: max(np.searchsorted(windows, len(places), "right"), 1)]  # the first fits, but for rounding
    found, straight = (
        np.stack(one) for one in zip(*[_averages(course, w, curve.closed) for w in windows], strict=True)
    )
    std = _noise(found)

    # Windows that the ends cut off say nothing: a bend is looked for in long ones as far as they fit, and measured in
    # the nearest that fits.
    numbers, last = np.arange(len(places)), len(places) - 1
    halves = np.zeros(len(windows), np.intp) if curve.closed else (0.5 * windows).astype(np.intp)
    wide = found[0].copy()
    for half, one in zip(halves[_LENGTHS[: len(windows)] <= _PLACE_WAVES], found, strict=False):
        wide[half : last + 1 - half] = one[half : last + 1 - half]
    sizes = np.linalg.norm(wide, axis=1)
    ways = np.divide(wide, sizes[:, None], out=np.zeros_like(wide), where=sizes[:, None] > 0.0)
    whole = np.clip(numbers, halves[:, None], last - halves[:, None])
    values = np.take_along_axis((found * ways).sum(axis=2), whole, axis=1)
    usable = np.take_along_axis(straight, whole, axis=1) >= _LEAST_DIRECTION
    curvature = _longest_that_agree(values, usable, std)

    before, after = (sizes[-1], sizes[0]) if curve.closed else (-1.0, -1.0)
    is_peak = (sizes >= np.append(before, sizes[:-1])) & (sizes > np.append(sizes[1:], after))
    is_peak &= whole[0] == numbers
    if not is_peak.any():
        is_peak[whole[0, sizes[whole[0]].argmax()]] = True
    best = int(np.where(is_peak, curvature, -1.0).argmax())
    return places, np.minimum(curvature, curvature[best]), best


def _averages(course: FloatArray, window: float, closed: bool) -> tuple[FloatArray, FloatArray]:
    """Return the curvature (n, d) over windows of so many points, and the length (n,) of the averaged tangents.

    It is that of the averaged tangents, which turn on a circle as the tangents themselves do.
    """
    half = int(0.5 * window)
    weights = (1.0 - (np.arange(-half, half + 1) / (0.5 * window)) ** 2) ** 2
    averages = convolve1d(course, weights / weights.sum(), axis=0, mode="wrap" if closed else "nearest")
    tangents, turns = np.split(averages, 2, axis=1)
    lengths = np.maximum(np.linalg.norm(tangents, axis=1), _TINY)
    along = tangents / lengths[:, None]
    return (turns - (turns * along).sum(axis=1, keepdims=True) * along) / lengths[:, None], lengths


def _noise(found: FloatArray) -> FloatArray:
    """Return the standard deviations (m,) of curvatures (m, n, d) over windows, the shortest first.

    Where a curve bends evenly, the difference of two windows is the noise of the shorter one, and most places do. The
    noise of the points is independent, so that the variance falls with the fifth power of the window.
    """
    other = min(int(np.searchsorted(_LENGTHS, 2.0)), len(found) - 1)
    squares = ((found[0] - found[other]) ** 2).sum(axis=1)
    std: FloatArray = (
        np.sqrt(np.median(squares) / _CHI_SQUARE_MEDIANS[found.shape[2] - 1]) * _LENGTHS[: len(found)] ** -2.5
    )
    return std


def _longest_that_agree(values: FloatArray, usable: npt.NDArray[np.bool_], std: FloatArray) -> FloatArray:
    """Return for each place the curvature (n,) of the longest window that agrees with all shorter ones.

    Parameters
    ----------
    values : numpy.ndarray, shape (m, n)
        Of each window, the shortest first, and each place.
    usable : numpy.ndarray, shape (m, n)
        Whether a window may be taken at all.
    std : numpy.ndarray, shape (m,)
    """
    reach = _DEVIATIONS * std[:, None]
    low, high = np.maximum.accumulate(values - reach), np.minimum.accumulate(values + reach)
    agree = np.logical_and.accumulate((low <= high) & usable)
    longest = np.maximum(agree.sum(axis=0) - 1, 0)
    curvature: FloatArray = np.maximum(np.take_along_axis(values, longest[None], axis=0)[0], 0.0)
    return curvature


def _radius(curvature: FloatArray) -> FloatArray:
    return np.divide(1.0, curvature, out=np.full(np.shape(curvature), np.inf), where=curvature > 0.0)
