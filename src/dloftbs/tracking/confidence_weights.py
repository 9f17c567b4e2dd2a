"""The confidence of tracks; made by ``python -m benchmarks.fit_track_confidence``.

docs/maintainers/track-confidence.md has what it was fitted to, and the results on each source left out.
"""

from __future__ import annotations

TRACK_CONFIDENCE = (-0.76, 0.37, -1.13, 0.57, -3.38)
"""Log-odds that the curve of a track is right: all else aside, and per unit of each of its `Signs`.

Source: fitted; see docs/maintainers/track-confidence.md.
"""
