"""Odds that an object of a soft mask is real; made by ``python -m benchmarks.soft_masks``.

docs/soft-masks.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

IS_REAL = (0.69, 0.65, -2.31, 3.03)
"""Log-odds that an object is real: none; by log-odds of its least sure tenth, log of unsteadiness, log of length.

Source: fitted; see docs/soft-masks.md.
"""
