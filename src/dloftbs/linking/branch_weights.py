"""Costs of branch points, nats."""

from __future__ import annotations

BRANCH_END = 2.0
"""Cost of an end that stays open at a junction because it is a branch's, where objects may branch, nats.

Source: fitted by ``python -m benchmarks.fit_branches``; from 1 to 2.5 as many scenes are right, to a hundredth.
"""

ROUND_END = 3.0
"""Cost of the roundness of a gap's ends besides that of cables, where objects may branch and have more tips, nats.

Source: fitted by ``python -m benchmarks.fit_branches``; from 2 to 4 as many scenes are right, to a hundredth.
"""

NODE = (1.6, 0.43)
"""Log-odds of a branch point, and per unit of its shortest branch, as `confidence_of` has them.

Source: fitted by ``python -m benchmarks.fit_branches``.
"""
