"""The curves of tracks, as a tracker expects them in a frame."""

from __future__ import annotations

from typing import NamedTuple

from dloftbs.data.curve import BSplineCurve


class Prediction(NamedTuple):
    """Predicted curve of a track.

    Parameters
    ----------
    curve : BSplineCurve
        In the image, px, in the track's direction.
    confidence : float
        The probability of its shape by the frames so far, less the longer ago it was seen, in 0..1.
    unseen : tuple of (float, float)
        The intervals of ``u`` that no frame has shown, or too few to be kept: they say nothing about a joint.
    id : int or None
        None if it is nobody's.
    width_px : float or None
        Of the object, px; None if it was never observed.
    apart : frozenset of int
        Ids of objects that it is known not to hang together with: its ends are not joined with theirs.
    inferred : tuple of (float, float)
        The intervals of ``u`` that the last frame did not show.
    existence : float
        Log-odds that it exists, nats.
    """

    curve: BSplineCurve
    confidence: float
    unseen: tuple[tuple[float, float], ...] = ()
    id: int | None = None
    width_px: float | None = None
    apart: frozenset[int] = frozenset()
    inferred: tuple[tuple[float, float], ...] = ()
    existence: float = 0.0
