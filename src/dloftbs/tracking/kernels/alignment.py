"""Alignment of curves with each other, sample by sample in their order: the distance of a track from a detection."""

from __future__ import annotations

import math

import numpy as np
from numba import boolean, float64

from dloftbs.kernels.compiler import Bools, Floats, Ints, helper, kernel, read
from dloftbs.tracking.kernels.interpolation import value_at

_MARGIN_RATIO = 3.0
"""Number of times that any other candidate must be farther than an unambiguous match.

Source: by hand.
"""

_STRIDE = 4
"""Step between the samples that show whether two curves are alike as they stand.

Source: bounds time.
"""

_SHIFT_WEIGHT = 0.5
"""Weight of the mean shift where starts are compared, ratio.

Source: by hand; a cable rather moves as a whole than slides along itself.
"""


_MIN_SAMPLES = 8
"""Least number of samples of a short curve that are compared.

Source: by hand; a direction and a bend take as many.
"""

_SEARCH_STEP = 2.0
"""Step between the starts that are tried first, samples.

Source: bounds time; it is then halved.
"""

_HALVINGS = 7
"""Number of halvings of that step.

Source: numerics; to 1/64 of a sample.
"""


@helper
def _distances_as_they_lie(tracks: Floats, found: Floats, limit: float) -> tuple[Floats, Ints]:
    """Return the mean distances of tracks (t, m, d) from curves (f, m, d), and their directions.

    A direction is 1 or -1, 0 if one is not clearly better than the other. Mean distances above `limit` are too small,
    but above it.
    """
    count, m, dims = tracks.shape
    others = len(found)
    distance, used = np.empty((count, others)), len(range(0, m, _STRIDE))
    way = np.zeros((count, others), dtype=np.int64)
    for t in range(count):
        for f in range(others):
            there, back = 0.0, 0.0
            for k in range(0, m, _STRIDE):
                one, other = 0.0, 0.0
                for d in range(dims):
                    one += (tracks[t, k, d] - found[f, k, d]) ** 2
                    other += (tracks[t, k, d] - found[f, m - 1 - k, d]) ** 2
                there += math.sqrt(one)
                back += math.sqrt(other)
                if min(there, back) > limit * used:
                    break  # too far already, whatever the rest adds
            distance[t, f] = min(there, back) / used
            if there * _MARGIN_RATIO < back:
                way[t, f] = 1
            elif back * _MARGIN_RATIO < there:
                way[t, f] = -1
    return distance, way


@kernel(read(float64, 3), read(float64, 1), read(float64, 3), float64)
def find_partners(tracks: Floats, lengths: Floats, found: Floats, max_mean: float) -> Ints:
    """Find the curve that alone is near to each track as a whole, which is alone near to it.

    Parameters
    ----------
    tracks : (t, m, d) float64
        Samples of each track's predicted curve.
    lengths : (t,) float64
        Of the tracks.
    found : (f, m, d) float64
        Samples of the curves found; one or more.
    max_mean : float
        Largest mean distance of a match, as a share of the length; no other curve or track may be as near.

    Returns
    -------
    (t,) int64
        One more than the index of the curve found, negative if that is reversed; 0 if it is ambiguous.
    """
    partner = np.zeros(len(tracks), dtype=np.int64)
    limit = _MARGIN_RATIO * max_mean * lengths.max()
    distance, way = _distances_as_they_lie(tracks, found, limit)
    for t in range(len(tracks)):
        best = int(np.argmin(distance[t]))
        limit = max(_MARGIN_RATIO * distance[t, best], max_mean * lengths[t])
        sure = distance[t, best] <= max_mean * lengths[t]
        for f in range(len(found)):
            sure &= f == best or distance[t, f] >= limit
        for other in range(len(tracks)):
            sure &= other == t or distance[other, best] >= limit
        if sure:
            partner[t] = way[t, best] * (best + 1)
    return partner


@helper
def _misfit(
    part: Floats,
    whole: Floats,
    share: float,
    start: float,
    backwards: bool,
    cyclic: bool,
    cap: float,
    shift_weight: float,
) -> float:
    """Return the mean distance, at most `cap` each, of a part from a whole along which it lies.

    Parameters
    ----------
    part : (n, d) float64
    whole : (m, d) float64
    share : float
        Length of the part, as a share of the whole's.
    start : float
        Its start, as a share of the whole.
    backwards : bool
        True if the part is reversed.
    cyclic : bool
        True if the whole is a loop.
    cap : float
    shift_weight : float
        Share of the mean shift that counts.
    """
    dims, last = part.shape[1], len(whole) - 1
    count = max(_MIN_SAMPLES, int(share * last) // 2 + 1)
    mean = np.zeros(dims)
    apart = np.empty((count, dims))
    for k in range(count):
        t = k / (count - 1)
        at = (1.0 - t if backwards else t) * (len(part) - 1)
        place = (start + t * share) * last
        place -= last * math.floor(place / last) if cyclic else 0.0
        for d in range(dims):
            apart[k, d] = value_at(part, at, d) - value_at(whole, place, d)
            mean[d] += apart[k, d] / count
    total = 0.0
    for k in range(count):
        squared = 0.0
        for d in range(dims):
            squared += (apart[k, d] - (1.0 - shift_weight) * mean[d]) ** 2
        total += min(math.sqrt(squared), cap)
    return total / count


@helper
def _align(
    part: Floats, whole: Floats, share: float, latest: float, cyclic: bool, cap: float
) -> tuple[float, float, bool]:
    """Return the least mean distance of a part along a whole, its start there, and True if it is reversed.

    Parameters
    ----------
    part : (n, d) float64
    whole : (m, d) float64
    share : float
    latest : float
        Largest start, as a share of the whole.
    cyclic : bool
    cap : float
    """
    steps = math.ceil(latest * (len(whole) - 1) / _SEARCH_STEP - 1e-9) if latest > 0.0 else 0
    best, at, flipped = math.inf, 0.0, False
    for way in range(2):
        backwards = way == 1
        for k in range(steps + (0 if cyclic and steps else 1)):
            start = latest * k / steps if steps else 0.0
            misfit = _misfit(part, whole, share, start, backwards, cyclic, cap, _SHIFT_WEIGHT)
            if misfit < best:
                best, at, flipped = misfit, start, backwards
    if steps:  # between the steps
        step = latest / steps
        for _ in range(_HALVINGS):
            step /= 2.0
            for side in (-1.0, 1.0):
                start = at + side * step
                if not cyclic:
                    start = min(max(start, 0.0), latest)
                misfit = _misfit(part, whole, share, start, flipped, cyclic, cap, _SHIFT_WEIGHT)
                if misfit < best:
                    best, at = misfit, start
    return _misfit(part, whole, share, at, flipped, cyclic, cap, 1.0), at, flipped


@kernel(read(float64, 2), read(float64, 2), float64, float64, float64)
def misfit_at(part: Floats, whole: Floats, share: float, start: float, shift_weight: float) -> float:
    """Return the mean distance of a part from an open whole along which it lies, in its own direction.

    Parameters
    ----------
    part : (n, d) float64
        Samples in order.
    whole : (m, d) float64
    share : float
        The length of the part by that of the whole.
    start : float
        Start of the part, as a share of the whole.
    shift_weight : float
        Share of the mean shift that counts, in 0..1.
    """
    return _misfit(part, whole, share, start, False, False, math.inf, shift_weight)


@kernel(
    read(float64, 3),
    read(float64, 1),
    read(boolean, 1),
    read(float64, 3),
    read(float64, 1),
    read(boolean, 1),
    read(float64, 2),
)
def align_all(
    tracks: Floats,
    track_lengths: Floats,
    track_closed: Bools,
    found: Floats,
    found_lengths: Floats,
    found_closed: Bools,
    cap: Floats,
) -> tuple[Floats, Floats, Bools]:
    """Align the shorter of each track and each curve found with the longer one, where it fits best.

    Of an open curve and a loop, the loop is the whole; a longer open one counts as one turn of it.

    Parameters
    ----------
    tracks : (t, m, d) float64
    track_lengths : (t,) float64
        Positive.
    track_closed : (t,) bool
    found : (f, m, d) float64
    found_lengths : (f,) float64
        Positive.
    found_closed : (f,) bool
    cap : (t, f) float64
        A sample's distance counts no more than this; pairs of which it is 0 are not measured.

    Returns
    -------
    misfit : (t, f) float64
        Mean distance; infinite if it is not measured.
    start : (t, f) float64
        Start of the shorter one, as a share of the longer one; of two loops, of the track.
    backwards : (t, f) bool
        True if the curve found is reversed.
    """
    shape = (len(tracks), len(found))
    misfit = np.empty(shape)
    start = np.empty(shape)
    backwards = np.empty(shape, dtype=np.bool_)
    for t in range(shape[0]):
        for f in range(shape[1]):
            if cap[t, f] <= 0.0:
                misfit[t, f], start[t, f], backwards[t, f] = math.inf, 0.0, False
                continue
            share = found_lengths[f] / track_lengths[t]
            track_is_whole = share <= 1.0
            if found_closed[f] != track_closed[t]:
                track_is_whole = track_closed[t]
            elif track_closed[t]:
                track_is_whole, share = True, 1.0
            if not track_is_whole:
                share = 1.0 / share
            share = min(share, 1.0)
            cyclic = track_closed[t] or found_closed[f]
            latest = 1.0 if cyclic else 1.0 - share
            if track_is_whole:
                result = _align(found[f], tracks[t], share, latest, cyclic, cap[t, f])
            else:
                result = _align(tracks[t], found[f], share, latest, cyclic, cap[t, f])
            misfit[t, f], start[t, f], backwards[t, f] = result
    return misfit, start, backwards
