"""Appearance of objects, their width and colour: two that differ clearly are different, wherever they lie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dloftbs._arrays import FloatArray
from dloftbs.evidence import OcclusionEvidence
from dloftbs.observation import Appearance, Observation
from dloftbs.tracking.sight import samples_within
from dloftbs.tracking.track_model import TrackModel

MAX_WIDTH_RATIO = 3.0
"""Ratio of widths above which two are different objects.

Source: by hand; a cable that comes nearer by a half is twice as wide.
"""

_OTHER_HUE_COSINE = 0.966
"""Cosine of the angle of two colours, as vectors of channels, below which they are of different objects.

Source: by hand; 15 degrees, as red and orange. More or less light changes the length of the vector, not its direction.
"""

_OTHER_BRIGHTNESS = 2.5
"""Ratio of the lengths of these vectors above which they are of different objects.

Source: by hand; a shadow takes less, and white is four times as bright as black, and more.
"""

_DARK = 10.0
"""Value added to each channel, levels of 255, so that noise makes no colour of black.

Source: by hand; three times the noise of a camera's 8-bit image.
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
    own, found = _table([m.appearance for m in models]), _table([one.appearance for one in observations])
    lengths = np.linalg.norm(own, axis=1)[:, None], np.linalg.norm(found, axis=1)[None]
    with np.errstate(invalid="ignore"):
        other_hue = own @ found.T < _OTHER_HUE_COSINE * lengths[0] * lengths[1]
        other_brightness = np.maximum(*lengths) > _OTHER_BRIGHTNESS * np.minimum(*lengths)
    differ: npt.NDArray[np.bool_] = other_hue | other_brightness
    return differ


def _table(appearances: Sequence[Appearance | None]) -> FloatArray:
    """Return colours (n, 3) as they are compared, NaN where they are unknown: these agree with any."""
    unknown = np.full(3, np.nan)
    return np.array([unknown if one is None else one.colour + _DARK for one in appearances]).reshape(-1, 3)


def widths_differ(one: float, other: float) -> bool:
    """Return True if two widths are clearly those of different objects; unknown ones, NaN, agree with any."""
    return not 1.0 / MAX_WIDTH_RATIO <= width_ratio(one, other) <= MAX_WIDTH_RATIO


def width_ratio(one: float, other: float) -> float:
    """Return the ratio of two widths or lengths; 1 if one is unknown, NaN."""
    return one / other if one > 0.0 and other > 0.0 else 1.0
