"""Belief in a track: evidence of its frames, in nats, that is forgotten at one rate."""

from __future__ import annotations

import math
from dataclasses import dataclass

_KEPT = 0.87
"""Share of the evidence that is kept from one frame to the next.

Source: by hand; frames are not independent, and half of it is forgotten in five of them.
"""

_REFUTED_NATS = -2.7
"""Log-odds below which nothing is laid by a shape any more, nats.

Source: by hand; odds of fifteen to one against it; of one long known it takes eight clear frames.
"""


READ_RIGHT = 0.83
"""Probability that a frame reads an object right, a share of all.

Source: measured; of one to three real cables in motion, by the mask alone.
"""

MISSED_NATS = math.log(1.0 - READ_RIGHT)
"""Log-odds for an object that a frame does not show, nats: it may be misread.

Source: by definition.
"""

_CONFIRMED_NATS = math.log(0.95 / 0.05)
"""Log-odds from which a track is confirmed, nats.

Source: by definition; it exists with a probability of .95.
"""


@dataclass(slots=True)
class Belief:
    """Belief in the shape of a track, or in its existence: what frames say of it, the last ones counting most.

    A shape is judged by the mean of what they say; existence by their sum, which forgetting bounds.
    """

    _sum: float = 0.0
    _weight: float = 0.0

    def add(self, log_odds: float) -> None:
        """Add a frame that speaks for it by so many nats, or against it if they are negative."""
        self._sum = _KEPT * self._sum + log_odds
        self._weight = _KEPT * self._weight + 1.0

    @property
    def total(self) -> float:
        """Sum of the log-odds, nats."""
        return self._sum

    @property
    def log_odds(self) -> float:
        """Mean log-odds, nats; 0 before the first frame."""
        return self._sum / self._weight if self._weight else 0.0

    @property
    def is_confirmed(self) -> bool:
        """True if the sum of what frames say is enough."""
        return self._sum >= _CONFIRMED_NATS

    @property
    def is_spent(self) -> bool:
        """True if the sum of what frames say speaks for it no more."""
        return self._sum <= 0.0

    @property
    def is_refuted(self) -> bool:
        """True if frames have clearly spoken against it."""
        return self.log_odds < _REFUTED_NATS

    @property
    def probability(self) -> float:
        """The same as a probability."""
        return 1.0 / (1.0 + math.exp(-self.log_odds))
