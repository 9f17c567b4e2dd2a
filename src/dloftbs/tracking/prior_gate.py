"""Gate of the temporal prior: frames that contradict it clearly are soon linked without it."""

from __future__ import annotations

_CLEAR_OVERRIDE = 1.0
"""Extra cost of a frame's joints over its own best ones above which it clearly contradicts the prior, nats.

Source: by hand.
"""

_MAX_OVERRIDES = 2
"""Number of such frames in a row that the prior survives no longer.

Source: by hand; one may be an accident.
"""

_FRAMES_WITHOUT_PRIOR = 10
"""Number of frames that are linked without a prior then.

Source: by hand; as many as the tracks need to give up what they believed.
"""


class PriorGate:
    """Counts the frames in a row in which the prior prevailed over clearly cheaper joints."""

    def __init__(self) -> None:
        self._overrides = 0
        self._frames_without = 0  # still to come

    @property
    def is_open(self) -> bool:
        """True if the next frame is linked with the prior."""
        return self._frames_without == 0

    def count(self, override: float) -> None:
        """Count a frame by the extra cost of its joints over the best ones without the prior."""
        self._frames_without = max(self._frames_without - 1, 0)
        self._overrides = self._overrides + 1 if override > _CLEAR_OVERRIDE else 0
        if self._overrides >= _MAX_OVERRIDES:
            self._overrides, self._frames_without = 0, _FRAMES_WITHOUT_PRIOR
