"""Costs of branch points, nats."""

from __future__ import annotations

BRANCH_END = 2.0
"""Cost of an end that stays open at a junction because it is a branch's, where objects may branch, nats.

Source: by hand; half of `OPEN_JUNCTION`, since objects are known to branch. It is not fitted yet.
"""
