"""The confidence of joints; made by ``python -m benchmarks.fit_linking confidence``.

docs/maintainers/linking-confidence.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

CROSSING = (3.83, 0.73, -0.74)
"""Log-odds that a joint through a junction is right: all else aside, per nat of margin, per nat of cost.

Source: fitted; see docs/maintainers/linking-confidence.md.
"""

GAP = (-5.29, 0.42, 2.55, -3.35)
"""Log-odds that a joint across a gap is right: all else aside, per nat of margin, per unit of `seen` and of `taper`.

Source: fitted; see docs/maintainers/linking-confidence.md.
"""
