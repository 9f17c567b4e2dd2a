"""Unambiguous matches: a detection that shows a track, but for a bit of an end, where nothing else is near."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dloftbs._arrays import FloatArray
from dloftbs.observation import Observation
from dloftbs.tracking.appearance import colours_differ, widths_differ
from dloftbs.tracking.kernels import alignment as kernels
from dloftbs.tracking.track_model import TrackModel

_MAX_MEAN = 0.02
"""Largest mean distance of an unambiguous match, as a share of the length.

Source: by hand; a hand's motion from frame to frame, and well below the gate.
"""

_MAX_ANYWHERE = 0.03
"""Largest distance of a sample of an unambiguous match, as a share of the length.

Source: by hand; one and a half times `_MAX_MEAN`, so that no end is missing.
"""

_MARGIN_RATIO = 3.0
"""Number of times that any other candidate must be farther than an unambiguous match.

Source: by hand.
"""


def match_unambiguous(
    models: Sequence[TrackModel], predicted: FloatArray, observations: Sequence[Observation]
) -> list[int]:
    """Return for each track one more than the index of its observation, negative if that is reversed, 0 if ambiguous.

    A match is unambiguous if the track was seen as a whole before and lies on the observation, which may end a little
    earlier or later, and nothing else is near.
    """
    if not observations:
        return [0] * len(models)
    closed = np.array([one.curve.closed for one in observations])
    points = np.array([one.points for one in observations])
    whole = np.array([not (m.sight.hidden or m.misses or m.curve.closed) for m in models])
    partner: list[int] = kernels.match_unambiguous(
        predicted,
        np.array([m.length for m in models]),
        whole,
        points,
        closed,
        _MAX_MEAN,
        _MAX_ANYWHERE,
        _MARGIN_RATIO,
    ).tolist()
    differ = colours_differ(models, observations)
    for t, p in enumerate(partner):
        if p:
            one = observations[abs(p) - 1]
            other = widths_differ(models[t].width, one.width) or models[t].is_torn_in(one)
            other = other or (one.curve_3d is not None and models[t].is_short(one))
            if other or differ[t, abs(p) - 1]:
                partner[t] = 0
    return partner
