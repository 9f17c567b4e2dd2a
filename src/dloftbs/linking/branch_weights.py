"""Costs of branch points, nats."""

from __future__ import annotations

BRANCH_END = 1.5
"""Cost of an end that stays open at a junction because it is a branch's, where objects may branch, nats.

Source: fitted by ``python -m benchmarks.fit_branches``: the middle of the costs at which the most scenes are right, 1 to 2.
"""

MOST_MARGIN = 5.0
"""Margin beyond which a joint that a branch point cuts says no more of it, nats.

Source: by hand; odds of 150 to one.
"""

NODE = (2.0, 0.0, 0.0, 0.0)
"""Log-odds of a branch point, and per unit of margin, of its shortest branch and of its reach, as `confidence_of`.

Source: fitted by ``python -m benchmarks.fit_branches``.
"""
