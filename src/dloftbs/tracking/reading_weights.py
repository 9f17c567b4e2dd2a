"""Weights of a reading of a frame; made by ``python -m benchmarks.fit_tracking``, which has what they are fitted to."""

from __future__ import annotations

from dloftbs.tracking.reading_features import Features

WEIGHTS = Features(
    length=-0.0512,
    place=-0.52,
    clear=0.107,
    parts=-0.174,
    sure_parts=1.65,
    part_length=-0.00898,
    part_place=-1.31,
    hidden=-0.0822,
    covered=0.242,
    in_sight=-0.682,
    known_hidden=0.0961,
    overruled=0.668,
    unclaimed=-0.55,
    births=-0.898,
    lost=-0.0558,
    sure_lost=-0.404,
)
"""Log-odds of a reading per unit of each feature, nats.

Source: fitted; see docs/tracking-weights.md.
"""
