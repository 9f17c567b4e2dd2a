"""Curves in space as markers, for RViz and Foxglove."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dloftbs.data.branch_point import BranchPoint
from dloftbs.ros.message_factory import MessageFactory
from dloftbs.ros.track_samples import SampledTrack, checked_samples
from dloftbs.support.values import check_all, check_type
from dloftbs.viz import Style

_SPHERE, _LINE_STRIP = 2, 4
_ADD, _DELETE, _DELETE_ALL = 0, 2, 3
_DIM = 0.25
"""Opacity of what the frame does not show."""
_MIN_WIDTH_M = 0.002
"""Width of a line: thinner ones are hard to see beside a robot."""
_NAMESPACE, _BRANCH_POINTS = "dloftbs", "dloftbs/branch_points"
_BALL_WIDTHS = 1.5
"""Diameter of a branch point, widths of the lines."""


class MarkerWriter:
    """Makes the marker of every track, and removes those of tracks that ended: it knows what a viewer shows.

    The first message begins with the removal of all markers, which may be those of an earlier process.

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
        self._shown_points: set[int] = set()
        self._has_begun = False
        self._style = Style()

    def message(self, header: Any, samples: Iterable[SampledTrack], branch_points: Iterable[BranchPoint] = ()) -> Any:
        """Return a ``visualization_msgs/MarkerArray``: a line strip a track, dim where the frame does not show it.

        Branch points that are known in space are white spheres in a namespace of their own.

        Parameters
        ----------
        header : std_msgs/Header
        samples : iterable of SampledTrack
            In metres.
        branch_points : iterable of BranchPoint
            In the same coordinate frame.

        Raises
        ------
        InputError
            If they are something else.
        """
        markers = [self._line(header, sample) for sample in checked_samples(samples, 3)]
        ids = {marker.id for marker in markers}
        ended = [self._bare(header, number, _DELETE) for number in sorted(self._shown - ids)]
        width_m = max([marker.scale.x for marker in markers], default=_MIN_WIDTH_M)
        spheres = [
            self._sphere(header, point.id or number, point.position_3d, _BALL_WIDTHS * width_m)
            for number, point in enumerate(check_all("branch_points", branch_points, BranchPoint), start=1)
            if isinstance(point, BranchPoint) and point.position_3d is not None
        ]
        points = {sphere.id for sphere in spheres}
        gone = sorted(self._shown_points - points)
        ended += [self._bare(header, number, _DELETE, _BRANCH_POINTS) for number in gone]
        if not self._has_begun:
            ended.insert(0, self._none(header))
        self._shown, self._shown_points = ids, points
        return self._make("visualization_msgs/msg/MarkerArray", markers=[*ended, *markers, *spheres])

    def clear(self, header: Any) -> Any:
        """Return the message that removes all markers, for when tracking begins anew."""
        self._shown, self._shown_points = set(), set()
        return self._make("visualization_msgs/msg/MarkerArray", markers=[self._none(header)])

    def _none(self, header: Any) -> Any:
        self._has_begun = True
        return self._bare(header, 0, _DELETE_ALL, "")  # of all namespaces: with a name, it removes those of this alone

    def _bare(self, header: Any, number: int, action: int, namespace: str = _NAMESPACE) -> Any:
        return self._make("visualization_msgs/msg/Marker", header=header, ns=namespace, id=number, action=action)

    def _sphere(self, header: Any, number: int, place: tuple[float, float, float], width_m: float) -> Any:
        make = self._make
        x, y, z = place
        upright = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        return make(
            "visualization_msgs/msg/Marker",
            header=header,
            ns=_BRANCH_POINTS,
            id=number,
            type=_SPHERE,
            action=_ADD,
            pose=make(
                "geometry_msgs/msg/Pose", position=make("geometry_msgs/msg/Point", x=x, y=y, z=z), orientation=upright
            ),
            scale=make("geometry_msgs/msg/Vector3", x=width_m, y=width_m, z=width_m),
            color=make("std_msgs/msg/ColorRGBA", r=1.0, g=1.0, b=1.0, a=1.0),
        )

    def _line(self, header: Any, sample: SampledTrack) -> Any:
        make = self._make
        blue, green, red = (channel / 255.0 for channel in self._style.colour(sample.track.id - 1))
        bright = make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=1.0)
        dim = make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=_DIM)
        width_m = max(sample.track.width_m or 0.0, _MIN_WIDTH_M)
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
