"""A rig's views from moment to moment, with identities that are the same in all views."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from dloftbs.config import Colour, Config, ConfigLike, RoiLike
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError
from dloftbs.pipeline import Pipeline
from dloftbs.segmentation import Segmenter
from dloftbs.stereo.doubts import RigDoubts
from dloftbs.stereo.epipolar_matching import EVIDENCE
from dloftbs.stereo.rig import CameraRig, View
from dloftbs.stereo.rig_result import RigResult
from dloftbs.stereo.rig_tracker import RigTracker, members_of
from dloftbs.stereo.shutters import steps_to_first
from dloftbs.support.arrays import FloatArray
from dloftbs.support.values import shown

_MEMORY = 0.9
"""Share of the evidence for a pair of tracks that is left after a moment.

Source: by hand; ten moments, a third of a second at 30 a second.
"""

_MOST_NATS = 6.0
"""Largest evidence for or against a pair of tracks, nats.

Source: by hand; 1 in 400, so that what is seen outweighs it within a few moments.
"""


class StereoPipeline:
    """Detection and tracking with a rig: from the views of each moment to curves in space with identities.

    A `Pipeline` follows the objects of each view. Which track of one view is which of another is evidence that adds up
    from moment to moment. An object keeps its id and its direction as long as a view's track or its place in space says
    that it is the same.

    Parameters
    ----------
    rig : CameraRig
    config, hsv, objects, segmenter, roi, mask_is
        As `Pipeline` has them, for all views.

    Raises
    ------
    InputError, ConfigError
        If an argument is of another type or out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from dloftbs import CameraRig, PinholeCamera, StereoPipeline
    >>> camera = PinholeCamera(900.0, 900.0, 100.0, 50.0)
    >>> beside = np.eye(4)
    >>> beside[0, 3] = 0.06
    >>> left, right = np.zeros((100, 200), bool), np.zeros((100, 200), bool)
    >>> left[10:90, 120:126], right[10:90, 60:66] = True, True
    >>> result = StereoPipeline(CameraRig([camera, camera], [np.eye(4), beside])).process([left, right])
    >>> result.tracks[0].id, round(float(result.objects[0].curve_3d.start[2]), 2)
    (1, 0.9)
    """

    def __init__(
        self,
        rig: CameraRig,
        config: ConfigLike | None = None,
        *,
        hsv: Colour | None = None,
        objects: int | None = None,
        segmenter: Segmenter | str | os.PathLike[str] | None = None,
        roi: RoiLike | None = None,
        mask_is: str | None = None,
    ) -> None:
        if not isinstance(rig, CameraRig):
            raise InputError(f"rig must be a CameraRig, got {shown(rig)}")
        if len(rig.cameras) < 2:
            raise InputError("a stream needs a rig of two cameras or more; of one that moves, detect(poses=) is for")
        self._rig = rig
        self._pipelines = [
            Pipeline(config, hsv=hsv, objects=objects, segmenter=segmenter, roi=roi, mask_is=mask_is)
            for _ in rig.cameras
        ]
        self._tracker = RigTracker()
        self._doubts = RigDoubts(lasting=True)
        self._evidence: dict[tuple[int, int, int, int], float] = {}
        self._next_index = 0

    def __repr__(self) -> str:
        return f"StereoPipeline({self._rig!r}, {self.config!r})"

    @property
    def config(self) -> Config:
        """The configuration of the views' pipelines."""
        return self._pipelines[0].config

    @property
    def rig(self) -> CameraRig:
        """The rig."""
        return self._rig

    def process(self, views: Sequence[View], *, mask: Sequence[npt.ArrayLike] | None = None) -> RigResult:
        """Find the objects of one moment and follow them from the moments before.

        Parameters
        ----------
        views : sequence of array_like, str, path or Frame
            One for each camera, in the rig's order.
        mask : sequence of array_like, optional
            A mask (H, W) for each view, beside images.

        Raises
        ------
        InputError, SourceError
            As `CameraRig.detect`.
        """
        geometry = self._rig._for(views)
        frames = self._rig._frames(views, geometry.cameras, self._pipelines[0], mask=mask, index=self._next_index)
        results, masks = [], []
        for pipeline, frame in zip(self._pipelines, frames, strict=True):
            results.append(pipeline.process(frame))
            own = pipeline.mask
            assert own is not None  # a frame was processed
            masks.append(own)
        self._next_index = frames[0].index + 1
        tracks = [_tracks_of(result) for result in results]
        combined, groups = self._rig._combine(
            results,
            masks,
            frames,
            geometry,
            self._doubts,
            self._carried(tracks),
            steps_to_first(results, triggered=self._rig.triggered, time_std_s=self._rig.time_std_s),
        )
        self._remember(combined, tracks)
        return self._tracker.update(combined, groups, tracks, results)

    def reset(self) -> None:
        """Forget all tracks, as at the cut to another scene."""
        for pipeline in self._pipelines:
            pipeline.reset()
        self._tracker.reset()
        self._evidence.clear()

    def _carried(self, tracks: Sequence[Sequence[int | None]]) -> dict[tuple[int, int], FloatArray]:
        """Return what earlier moments say of pairs of detections, as costs of a point."""
        costs = {}
        for a in range(len(tracks)):
            for b in range(a + 1, len(tracks)):
                own = np.array(
                    [
                        [0.0 if i is None or j is None else self._evidence.get((a, i, b, j), 0.0) for j in tracks[b]]
                        for i in tracks[a]
                    ]
                ).reshape(len(tracks[a]), len(tracks[b]))
                costs[a, b] = own * (-2.0 / EVIDENCE)
        return costs

    def _remember(self, combined: RigResult, tracks: Sequence[Sequence[int | None]]) -> None:
        """Add this moment's evidence for pairs of tracks to that of earlier ones."""
        faded = {pair: _MEMORY * nats for pair, nats in self._evidence.items()}
        self._evidence = {pair: nats for pair, nats in faded.items() if abs(nats) > 0.1}
        for one in combined.objects:
            members = members_of(one, tracks)
            shown_in = [(view, number) for view, number in enumerate(members) if number is not None]
            if one.curve_3d is None or len(shown_in) < 2:
                continue
            share = min(max(one.confidence, 1e-3), 1.0 - 1e-3)
            for k, (a, i) in enumerate(shown_in):
                for b, j in shown_in[k + 1 :]:
                    nats = self._evidence.get((a, i, b, j), 0.0) + math.log(share / (1.0 - share))
                    self._evidence[a, i, b, j] = min(max(nats, -_MOST_NATS), _MOST_NATS)


def _tracks_of(result: FrameResult) -> list[int | None]:
    """Return for each detection of a view the id of its track there."""
    ids: list[int | None] = [None] * len(result.detections)
    for track in result.tracks:
        number, _ = result._place_of(track)
        if number is not None:
            ids[number] = track.id
    return ids
