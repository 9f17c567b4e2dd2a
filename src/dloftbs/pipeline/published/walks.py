"""As published: branch points removed, the rest walked from end to end (paper: walk along segments)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dloftbs.config import GreedyLinkingConfig
from dloftbs.data.centerline import Segment
from dloftbs.data.mask_crop import MaskCrop, Skeleton
from dloftbs.kernels import tracing
from dloftbs.support.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Walks:
    """Paths of the walks, as arrays of points (n, 2), oriented ``(x, y)``.

    Parameters
    ----------
    open : list of numpy.ndarray
        With two ends each, of at least `GreedyLinkingConfig.min_length_px` points.
    loops : list of numpy.ndarray
        Without ends, as long; the last point touches the first.
    short : list of numpy.ndarray
        The rest.
    """

    open: list[FloatArray]
    loops: list[FloatArray]
    short: list[FloatArray]


def walk(skeleton: Skeleton, config: GreedyLinkingConfig) -> Walks:
    """Remove the branch points, walk the rest, and drop walks of less than ``p`` pixels.

    Without branch points no pixel has more than two neighbours, so every walk is unambiguous. What has no endpoint is a
    closed loop and is walked around once, from its first pixel.
    """
    points, offsets, n_open = tracing.trace(skeleton.grid, skeleton.pixels_rc, skeleton.degrees)
    runs = [points[start:stop] for start, stop in pairwise(offsets.tolist())]
    p = config.min_length_px
    return Walks(
        open=[run for run in runs[:n_open] if len(run) >= p],
        loops=[run for run in runs[n_open:] if len(run) >= p],
        short=[run for run in runs if len(run) < p],
    )


def make_segments(crop: MaskCrop, runs: list[FloatArray]) -> list[Segment]:
    """Give each run its radius, and turn it from the orientation of the crop into the image.

    The radius is half the distance between the edges of the mask to both sides of the run.
    """
    if not runs:
        return []
    offsets = np.cumsum([0, *map(len, runs)])
    oriented = np.concatenate(runs)
    radius = tracing.measure_radius(crop.oriented(crop.pixels), oriented, offsets)
    points = crop.to_image(oriented)
    return [Segment._unchecked(points[start:stop], radius[start:stop]) for start, stop in pairwise(offsets.tolist())]
