"""Costs of branch points, nats."""

from __future__ import annotations

BRANCH_END = 2.0
"""Cost of an end that stays open at a junction because it is a branch's, where objects may branch, nats.

Source: fitted by ``python -m benchmarks.fit_branches``; from 1 to 2.5 as many scenes are right, to a hundredth.
"""

NODE = (-0.56, 1.62)
"""Log-odds of a branch point, and per unit of its shortest branch, as `confidence_of` has them.

Source: fitted by ``python -m benchmarks.fit_branches``.
"""
