"""Objects that were found, but are left out of a frame's detections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dloftbs.data.centerline import Centerline, Segment
from dloftbs.support.arrays import LARGEST
from dloftbs.support.values import check_number, check_text, check_type, set_fields, values_of


@dataclass(frozen=True, eq=False)
class Dropped:
    """Object that was found, but is no detection.

    Parameters
    ----------
    centerline : Centerline
    reason : str
        Why it was left out.
    probability : float
        Probability that it is a cable at all, in 0..1.

    Raises
    ------
    InputError
        If a value is of another type or out of range.
    """

    centerline: Centerline
    reason: str
    probability: float

    def __post_init__(self) -> None:
        check_type("centerline", self.centerline, Centerline)
        set_fields(
            self,
            reason=check_text("reason", self.reason),
            probability=check_number("probability", self.probability, 0.0, 1.0),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; without a curve, the ``u`` of its joints says nothing."""
        line = self.centerline
        return {
            "start": line.points[0].tolist(),
            "end": line.points[-1].tolist(),
            "closed": line.closed,
            "width_px": line.width_px,
            "confidence": line.confidence,
            "reason": self.reason,
            "probability": self.probability,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Dropped:
        """Build it from what `to_dict` gave: of the centre line only the ends are known.

        Raises
        ------
        InputError
            If it is no dictionary, a key is missing or a value is wrong.
        """
        keys = "start", "end", "closed", "width_px", "confidence", "reason", "probability"
        start, end, closed, width, confidence, reason, probability = values_of("a dropped object", data, *keys)
        radius = 0.5 * check_number("width_px", width, 0.0, LARGEST)
        # `Segment` and `Centerline` check what they are given: it comes from a file, and is of any type until then.
        line = Centerline((Segment([start, end], [radius, radius]),), (), closed, (), confidence)  # type: ignore[arg-type]
        return cls(line, reason, probability)
