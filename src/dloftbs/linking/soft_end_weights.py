"""Odds that a cable goes on, by what is ahead of its end; made by ``python -m benchmarks.soft_masks``.

docs/soft-masks.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

GOES_ON = (4.32, 1.09)
"""Log-odds that a cable goes on where all is sure ahead of its end, and per unit of its logarithm.

Source: fitted; see docs/soft-masks.md.
"""
