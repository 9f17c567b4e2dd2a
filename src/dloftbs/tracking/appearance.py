"""Appearance of objects, their width and colour: two that differ clearly are different, wherever they lie."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.evidence import OcclusionEvidence
from dloftbs.observation import Appearance, Observation
from dloftbs.tracking.kernels.colour_differences import compare_colours
from dloftbs.tracking.sight import samples_within
from dloftbs.tracking.track_model import TrackModel

MAX_WIDTH_RATIO = 3.0
"""Ratio of widths above which two are different objects.

Source: by hand; a cable that comes nearer by a half is twice as wide.
"""

_UNKNOWN = (math.nan, math.nan, math.nan)
"""Colour that agrees with any, BGR.

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


def colours_differ(models: Sequence[TrackModel], observations: Sequence[Observation]) -> npt.NDArray[np.bool_]:
    """Return, for each track and observation, True if they differ clearly in colour, shape (t, d)."""
    if all(one.appearance is None for one in observations):
        return np.zeros((len(models), len(observations)), np.bool_)
    own, found = (_colours([one.appearance for one in some]) for some in (models, observations))
    return compare_colours(own, found)


def colour_differs(model: TrackModel, observation: Observation) -> bool:
    """Return the same of one track and one observation."""
    own, found = model.appearance, observation.appearance
    return own is not None and found is not None and bool(compare_colours(own.colour[None], found.colour[None])[0, 0])


def _colours(appearances: Sequence[Appearance | None]) -> FloatArray:
    """Return colours (n, 3), NaN where they are unknown."""
    return np.array([_UNKNOWN if one is None else one.colour for one in appearances]).reshape(-1, 3)


def widths_differ(one: float, other: float) -> bool:
    """Return True if two widths are clearly those of different objects; unknown ones, NaN, agree with any."""
    return not 1.0 / MAX_WIDTH_RATIO <= width_ratio(one, other) <= MAX_WIDTH_RATIO


def width_ratio(one: float, other: float) -> float:
    """Return the ratio of two widths or lengths; 1 if one is unknown, NaN."""
    return one / other if one > 0.0 and other > 0.0 else 1.0
