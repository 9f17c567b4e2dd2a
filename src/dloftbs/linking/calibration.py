"""The confidence of joints by their margin and cost; made by ``python -m benchmarks.fit_linking confidence``.

docs/linking-confidence.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

CROSSING = (3.85, 0.77, -0.73)
"""Log-odds that a joint through a junction is right, without margin and cost, per nat of margin and per nat of cost.

Source: fitted; see docs/linking-confidence.md.
"""

GAP = (2.40, 0.47, -0.64)
"""Log-odds that a joint across a gap is right, without margin and cost, per nat of margin and per nat of cost.

Source: fitted; see docs/linking-confidence.md.
"""
