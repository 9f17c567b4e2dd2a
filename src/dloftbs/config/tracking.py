"""Sections of the tracking, one for each method."""

from __future__ import annotations

from typing import Literal

from dloftbs.config.section import MAX, MIN, Section, keep_number, require

_SHORTEST_S = 1e-6  # from frame to frame


class TrackingConfig(Section, frozen=True, kw_only=True, tag_field="method", tag="motion"):
    """Detections to tracks, by where they are expected.

    Parameters
    ----------
    gate : float
        A detection is the same object as a track only while their mean distance is below this share of the length, the
        geometric mean of both lengths being meant. It widens while the track is not seen.
    keep_lost_s : float
        Seconds for which a confirmed track of which nothing is seen can be found again under its id. A longer pause of
        the stream ends all tracks.
    smoothing_s : float
        Lag of the published curves, which makes them smoother; 0: neither.
    frame_s : float
        Seconds from frame to frame where frames have no stamps. Where they do, a frame is a pause only if it takes
        clearly longer than this and than most of the last five, or than a quarter of a second at the start.
    on_new_size, on_old_stamp : str
        Reaction to a frame of another size, or of a stamp before the last one: ``"reset"`` forgets the tracks,
        ``"error"`` raises an `InputError`.
    """

    gate: float = 0.1
    keep_lost_s: float = 2.0
    smoothing_s: float = 0.0
    frame_s: float = 1.0 / 30.0
    on_new_size: Literal["reset", "error"] = "reset"
    on_old_stamp: Literal["reset", "error"] = "reset"

    def __post_init__(self) -> None:
        keep_number(self, "gate", MIN, MAX)
        keep_number(self, "keep_lost_s", 0.0, MAX)
        keep_number(self, "smoothing_s", 0.0, MAX)
        keep_number(self, "frame_s", _SHORTEST_S, MAX)
        for name in ("on_new_size", "on_old_stamp"):
            way = getattr(self, name)
            require(isinstance(way, str) and way in ("reset", "error"), name, "'reset' or 'error'", way)


class NearestTrackingConfig(Section, frozen=True, kw_only=True, tag_field="method", tag="nearest"):
    """Detections to tracks, as published: by the nearest curve of the frame before, and nothing else."""
