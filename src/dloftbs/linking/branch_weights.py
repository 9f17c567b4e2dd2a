"""Costs of branch points, nats; made by ``python -m benchmarks.fit_branches``.

docs/harnesses.md has what they were fitted to, and the results on each source left out.
"""

from __future__ import annotations

BRANCH_END = 2.0
"""Cost of an end that stays open at a junction because it is a branch's, where objects may branch, nats.

Source: fitted; see docs/harnesses.md.
"""
