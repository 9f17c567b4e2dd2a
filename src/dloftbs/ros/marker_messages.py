"""Curves in space as markers, for RViz and Foxglove."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from dloftbs.ros.message_factory import MessageFactory
from dloftbs.ros.track_samples import SampledTrack, checked_samples
from dloftbs.support.values import check_type
from dloftbs.viz import Style

_LINE_STRIP = 4
_ADD, _DELETE, _DELETE_ALL = 0, 2, 3
_DIM = 0.25
"""Opacity of what the frame does not show."""
_MIN_WIDTH_M = 0.002
"""Width of a line: thinner ones are hard to see beside a robot."""
_NAMESPACE = "dloftbs"


class MarkerWriter:
    """Makes the marker of every track, and removes those of tracks that ended: it knows what a viewer shows.

    Parameters
    ----------
    make : MessageFactory

    Raises
    ------
    InputError
        If it is none.
    """

    def __init__(self, make: MessageFactory) -> None:
        check_type("make", make, MessageFactory)
        self._make = make
        self._shown: set[int] = set()
        self._style = Style()

    def message(self, header: Any, samples: Iterable[SampledTrack]) -> Any:
        """Return a ``visualization_msgs/MarkerArray``: a line strip a track, dim where the frame does not show it.

        Parameters
        ----------
        header : std_msgs/Header
        samples : iterable of SampledTrack
            In metres.

        Raises
        ------
        InputError
            If they are something else.
        """
        markers = [self._line(header, sample) for sample in checked_samples(samples, 3)]
        ids = {marker.id for marker in markers}
        ended = [self._bare(header, number, _DELETE) for number in sorted(self._shown - ids)]
        self._shown = ids
        return self._make("visualization_msgs/msg/MarkerArray", markers=[*ended, *markers])

    def clear(self, header: Any) -> Any:
        """Return the message that removes all markers, for when tracking begins anew."""
        self._shown = set()
        bare = self._bare(header, 0, _DELETE_ALL)
        return self._make("visualization_msgs/msg/MarkerArray", markers=[bare])

    def _bare(self, header: Any, number: int, action: int) -> Any:
        return self._make("visualization_msgs/msg/Marker", header=header, ns=_NAMESPACE, id=number, action=action)

    def _line(self, header: Any, sample: SampledTrack) -> Any:
        make = self._make
        blue, green, red = (channel / 255.0 for channel in self._style.colour(sample.track.id - 1))
        bright = make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=1.0)
        dim = make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=_DIM)
        width_m = max(_width_m(sample), _MIN_WIDTH_M)
        upright = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        return make(
            "visualization_msgs/msg/Marker",
            header=header,
            ns=_NAMESPACE,
            id=sample.track.id,
            type=_LINE_STRIP,
            action=_ADD,
            pose=make("geometry_msgs/msg/Pose", orientation=upright),
            scale=make("geometry_msgs/msg/Vector3", x=width_m, y=0.0, z=0.0),
            color=bright,
            points=[make("geometry_msgs/msg/Point", x=x, y=y, z=z) for x, y, z in sample.points.tolist()],
            colors=[dim if inferred else bright for inferred in sample.inferred.tolist()],
        )


def _width_m(sample: SampledTrack) -> float:
    """Return the width in space that the width in the image has at the median distance; 0 where it is not known."""
    track = sample.track
    if track.width_px is None or track.camera is None or track.curve_3d is None:
        return 0.0
    own = track.curve_3d(np.linspace(0.0, 1.0, len(sample.points)))  # the points may be in another coordinate frame
    return float(track.width_px * np.median(own[:, 2]) / np.sqrt(track.camera.fx * track.camera.fy))
