"""Weights of a reading of a frame; made by ``python -m benchmarks.fit_tracking``, which has what they are fitted to."""

from __future__ import annotations

from dloftbs.tracking.reading_features import Features

WEIGHTS = Features(
    length=-0.067,
    place=-1.2,
    clear=0.117,
    parts=-0.583,
    belief=0.326,
    part_place=-1.25,
    covered=0.268,
    bare=-0.194,
    unclaimed=-0.682,
)
"""Log-odds of a reading per unit of each feature, nats.

Source: fitted; see docs/maintainers/tracking-weights.md.
"""
