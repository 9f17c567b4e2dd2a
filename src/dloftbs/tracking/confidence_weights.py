"""The confidence of tracks; made by ``python -m benchmarks.fit_track_confidence``.

docs/maintainers/track-confidence.md has what it was fitted to, and the results on each source left out.
"""

from __future__ import annotations

TRACK_CONFIDENCE = (-0.39, 0.38, -1.29, 0.54, -3.73)
"""Log-odds that the curve of a track is right: with none of its `Signs`, and per unit of each.

Source: fitted; see docs/maintainers/track-confidence.md.
"""
