"""Appearance of objects, their width and colour: two that differ clearly are different, wherever they lie."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dloftbs.evidence import Appearance, OcclusionEvidence, compare_pairs
from dloftbs.support.arrays import BoolArray, FloatArray, IntArray
from dloftbs.tracking.kernels.pairs import ratios_differ
from dloftbs.tracking.observation import Observation
from dloftbs.tracking.sight import samples_within
from dloftbs.tracking.track_model import TrackModel

MAX_WIDTH_RATIO = 3.0
"""Ratio of widths above which two are different objects.

Source: by hand; a cable that comes nearer by a half is twice as wide.
"""

_UNKNOWN = Appearance(np.zeros((0, 3)), np.full(3, math.nan))
"""Appearance that agrees with any, BGR, grey levels.

Source: by definition.
"""


def with_appearances(observations: Sequence[Observation], evidence: OcclusionEvidence | None) -> list[Observation]:
    """Return the observations with their appearances, as far as a frame's evidence has an image."""
    if evidence is None or not evidence.has_image:
        return list(observations)
    return [
        one._replace(appearance=evidence.sample(one.points, ~samples_within(one.gaps), one.width))
        for one in observations
    ]


def objects_differ(models: Sequence[TrackModel], observations: Sequence[Observation]) -> BoolArray:
    """Return, for each track and observation, True if they differ clearly, in colour or in width, shape (t, d)."""
    own, found = (np.array([one.width for one in some], np.float64) for some in (models, observations))
    by_width = ratios_differ(own, found, MAX_WIDTH_RATIO)
    if all(one.appearance is None for one in observations):
        return by_width
    colours = _colours([*(one.appearance for one in models), *(one.appearance for one in observations)])
    pairs = np.indices(by_width.shape).reshape(2, -1).T + np.array([0, len(models)])
    by_colour: BoolArray = compare_pairs(*colours, pairs).reshape(by_width.shape)
    return by_width | by_colour


def colour_differs(model: TrackModel, observation: Observation) -> bool:
    """Return the same of one track and one observation."""
    own, found = model.appearance, observation.appearance
    return own is not None and found is not None and bool(compare_pairs(*_colours([own, found]), np.array([[0, 1]]))[0])


def _colours(appearances: Sequence[Appearance | None]) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return median colours (n, 3), NaN where they are unknown, all samples (k, 3), and their offsets (n + 1,)."""
    known = [_UNKNOWN if one is None else one for one in appearances]
    offsets = np.cumsum([0, *(len(one.cable) for one in known)])
    return np.array([one.colour for one in known]), np.concatenate([one.cable for one in known]), offsets


def widths_differ(one: float, other: float) -> bool:
    """Return True if two widths are clearly those of different objects; unknown ones, NaN, agree with any."""
    return not 1.0 / MAX_WIDTH_RATIO <= width_ratio(one, other) <= MAX_WIDTH_RATIO


def width_ratio(one: float, other: float) -> float:
    """Return the ratio of two widths or lengths; 1 if one is unknown, NaN."""
    return one / other if one > 0.0 and other > 0.0 else 1.0
