"""The confidence of joints by their margin and cost; made by ``python -m benchmarks.fit_linking confidence``.

docs/linking-confidence.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

CROSSING = (3.88, 0.73, -0.75)
"""Log-odds that a joint through a junction is right, without margin and cost, per nat of margin and per nat of cost.

Source: fitted; see docs/linking-confidence.md.
"""

GAP = (1.67, 0.59, -0.48)
"""Log-odds that a joint across a gap is right, without margin and cost, per nat of margin and per nat of cost.

Source: fitted; see docs/linking-confidence.md.
"""
